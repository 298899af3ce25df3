#!/usr/bin/env bash
# The core's own checks on the host: its tests under sanitizers, and the frame decoder fuzzed.
# `run.sh tests` runs the tests alone, without sanitizers, for tests/mutants.py.
set -euo pipefail
cd "$(dirname "$0")"
build=../../build/firmware
mkdir -p "$build"
warnings="-Wall -Wextra -Werror"
core=(../joint/src/core/*.cpp)
world=(../sim/src/*.cpp)
host=(${CXX:-c++} -std=c++17 $warnings -O1 -g -ffp-contract=off)

tests=(main.cpp test_*.cpp "${core[@]}" "${world[@]}" -o "$build/tests")
if [ "${1:-}" = tests ]; then
  "${host[@]}" -Wno-error "${tests[@]}"
  exec "$build/tests"
fi

echo "host tests under address and undefined-behaviour sanitizers"
"${host[@]}" -fsanitize=address,undefined -fno-sanitize-recover=all "${tests[@]}"
"$build/tests"

echo "fuzzing the frame decoder"
fuzzer=(fuzz.cpp "${core[@]}" "${world[@]}" -o "$build/fuzz")
if clang++ -std=c++17 $warnings -O1 -g -ffp-contract=off -DBIOSCARA_LIBFUZZER -fno-sanitize-recover=all \
  -fsanitize=fuzzer,address,undefined "${fuzzer[@]}" 2>"$build/clang.log"; then
  mkdir -p "$build/corpus"
  "$build/fuzz" -runs=100000 -max_len=66 -seed=1 -verbosity=0 -print_final_stats=1 \
    -artifact_prefix="$build/" "$build/corpus" >"$build/fuzz.log" 2>&1 ||
    { cat "$build/fuzz.log" >&2; exit 1; }
  grep number_of_executed_units "$build/fuzz.log"
else
  # Without clang and its fuzzer: random frames, the same ones each time.
  "${host[@]}" -fsanitize=address,undefined -fno-sanitize-recover=all "${fuzzer[@]}"
  "$build/fuzz" 100000
fi
