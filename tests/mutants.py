"""Removes one safety guard after the other and requires that a test fails.

``make mutants``; with words as arguments, only the guards whose names contain one of them. They
are in ``mutants.txt``. Each mutant is a copy of the sources with one change; the tests that should
fail run against it, and first without any. A mutant that no test notices, or a change that no
longer applies, is a failure.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from source_places import apply

ROOT = Path(__file__).parents[1]
BOARDS = ROOT / "firmware/joint/boards"
"""Not in the simulation: only the images have it."""


@dataclass(frozen=True)
class Mutant:
    """One guard removed: in ``place``, see source_places.py, ``old`` becomes ``new``."""

    guard: str
    place: str
    old: str
    new: str
    tests: tuple[str, ...]
    """Which should notice."""


HOST = ("firmware/tests",)
"""The core's own tests, compiled with it; not run by pytest."""
HOST_BINARY = "build/firmware/tests"


def read(text: str) -> tuple[Mutant, ...]:
    """Return the guards of a table; its first lines say how it is written.

    Raises:
        ValueError: A line is none of those.
    """
    found: list[Mutant] = []
    tests: tuple[str, ...] = ()
    for line in filter(None, text.splitlines()):
        sign, rest = line[0], line[2:]
        if sign == "[":
            tests = tuple(line.strip("[]").split())
        elif sign == "-" and found:
            found[-1] = replace(found[-1], old=f"{found[-1].old}\n{rest}".lstrip("\n"))
        elif sign == "+" and found:
            found[-1] = replace(found[-1], new=f"{found[-1].new}\n{rest}".lstrip("\n"))
        elif " @ " in line and sign != "#":
            guard, _, place = line.partition(" @ ")
            found.append(Mutant(guard, place, "", "", tests))
        elif sign != "#":
            raise ValueError(f"{line}: not [TESTS], NAME @ PLACE, - OLD or + NEW")
    return tuple(found)


MUTANTS = read(Path(__file__).with_suffix(".txt").read_text())


@contextmanager
def _copy() -> Iterator[Path]:
    """Copy the repository to a folder that is removed afterwards."""
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"],
        cwd=ROOT,
        check=True,
        capture_output=True,
        text=True,
    )
    with tempfile.TemporaryDirectory() as folder:
        # Tests as another user import from it, too.
        Path(folder).chmod(0o755)
        tree = Path(folder) / "tree"
        for name in filter(None, listed.stdout.split("\0")):
            (tree / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, tree / name)
        yield tree


def _build(tree: Path) -> None:
    """Build the firmware for the simulated arm, into ``native`` next to the tests."""
    subprocess.run(
        [
            *(sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--upgrade"),
            *("--target", str(tree / "native"), str(tree / "firmware")),
        ],
        check=True,
    )


def _build_images(tree: Path) -> None:
    """Build the images before the tests, which would all fail or be skipped without them."""
    build = subprocess.run(
        ["make", "--no-print-directory", "-C", str(tree / "firmware/joint")],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    if build.returncode != 0:
        raise SystemExit(f"the images were not built\n{build.stdout}")


def _red(tests: tuple[str, ...], tree: Path) -> bool:
    """Return whether tests fail in a copy."""
    if tests == HOST:
        words = [str(tree / "firmware/tests/run.sh"), "tests"]
    else:
        words = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *tests]
    run = subprocess.run(
        words,
        cwd=tree,
        env={
            **os.environ,
            "PYTHONPATH": f"{tree / 'native'}{os.pathsep}{tree / 'src'}",
            # Most tests that run here have to fail.
            "BIOSCARA_REPETITIONS": "1",
        },
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    # A crash of the core's own tests is a finding, too.
    ran = (tree / HOST_BINARY).exists() if tests == HOST else run.returncode in {0, 1}
    if not ran:
        raise SystemExit(f"{' '.join(tests)} did not run\n{run.stdout}")
    return run.returncode != 0


def _red_as_it_is(tests: tuple[str, ...]) -> bool:
    with _copy() as tree:
        if any("emulated" in each for each in tests):
            _build_images(tree)
        return _red(tests, tree)


def _noticed(mutant: Mutant) -> bool:
    with _copy() as tree:
        file, text = apply(mutant.place, mutant.old, mutant.new)
        (tree / file.relative_to(ROOT)).write_text(text)
        if file.is_relative_to(BOARDS):
            _build_images(tree)
        elif file.is_relative_to(ROOT / "firmware") and mutant.tests != HOST:
            _build(tree)
        return _red(mutant.tests, tree)


def main() -> int:
    """Try every mutant; return 1 if one goes unnoticed."""
    words = sys.argv[1:] or [""]
    mutants = [each for each in MUTANTS if any(word in each.guard for word in words)]
    tried = len(mutants)
    sets = list(dict.fromkeys(each.tests for each in mutants))
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        print(f"{len(sets)} sets of tests without any mutant", flush=True)  # noqa: T201
        useless = {
            each for each, red in zip(sets, pool.map(_red_as_it_is, sets), strict=True) if red
        }
        for tests in useless:
            print(f"RED without any mutant: {' '.join(tests)}", flush=True)  # noqa: T201
        unnoticed = [each.guard for each in mutants if each.tests in useless]
        mutants = [each for each in mutants if each.tests not in useless]
        for mutant, noticed in zip(mutants, pool.map(_noticed, mutants), strict=True):
            print(f"{'red ' if noticed else 'GREEN'} without: {mutant.guard}", flush=True)  # noqa: T201
            if not noticed:
                unnoticed.append(mutant.guard)
    print(f"{tried - len(unnoticed)} passed, {len(unnoticed)} failed")  # noqa: T201
    return 1 if unnoticed else 0


if __name__ == "__main__":
    sys.exit(main())
