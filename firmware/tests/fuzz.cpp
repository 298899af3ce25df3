// Frames of any content to the decoder, between ticks: no crash, no undefined behaviour, and no
// answer longer than its buffer. With clang: -fsanitize=fuzzer; otherwise a random driver.
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "../joint/src/core/bytes.h"
#include "../sim/src/arm.h"

namespace {

bioscara::sim::Arm& arm() {
  static bioscara::sim::Arm instance(7, bioscara::sim::Timing{0.0, 0.0},
                                     bioscara::sim::Arm::Firmwares{});
  return instance;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // The first byte sets how much time passes and whether the check byte is corrected, the second
  // how many bytes are read.
  constexpr std::size_t kMost = 64;
  if (size < 2 || size > kMost + 2) return 0;
  std::uint8_t frame[kMost];
  const std::size_t length = size - 2;
  std::memcpy(frame, data + 2, length);
  if ((data[0] & 4) != 0 && length > 2) {
    constexpr std::uint8_t kAddress = 0x11 << 1;
    frame[length - 1] =
        bioscara::crc8(bioscara::crc8(0, &kAddress, 1), frame, length - 1);
  }
  std::uint8_t answer[kMost];
  arm().run((data[0] & 3) * 1e-3);
  arm().transfer(0x11, frame, length, answer, data[1] & 0x1F);
  return 0;
}

#ifndef BIOSCARA_LIBFUZZER
int main(int count, char** arguments) {
  const long rounds = count > 1 ? std::strtol(arguments[1], nullptr, 10) : 200000;
  std::uint64_t state = 88172645463325252ULL;
  const auto next = [&state] {
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return static_cast<std::uint8_t>(state >> 24);
  };
  for (long round = 0; round < rounds; ++round) {
    std::uint8_t frame[40];
    const std::size_t size = next() % sizeof frame;
    for (std::size_t i = 0; i < size; ++i) frame[i] = next();
    // Half of the frames begin with a register that exists.
    if (size > 2 && (round & 1) != 0) frame[2] = 0x0F + next() % 0x20;
    LLVMFuzzerTestOneInput(frame, size);
  }
  std::printf("%ld frames, no finding\n", rounds);
  return 0;
}
#endif
