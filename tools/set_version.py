"""Set the version of everything that is released together: ``python -m tools.set_version 0.2.0``.

Without a number it prints the present one, or fails where two differ. It needs no environment.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
_NUMBER = r"\d+\.\d+\.\d+"
PLACES = {
    "src/bioscara/version.py": rf'__version__ = "({_NUMBER})"',
    "pyproject.toml": rf'^(?:version = "|sim = \["bioscara-firmware-sim==)({_NUMBER})"',
    "firmware/pyproject.toml": rf'^version = "({_NUMBER})"',
    "firmware/joint/src/core/version.h": r"kFirmware(?:Major|Minor|Patch) = (\d+);",
    "interfaces/pyproject.toml": rf'^version = "({_NUMBER})"',
    "ros/pyproject.toml": rf'^version = "({_NUMBER})"',
    "ros/*/package.xml": rf"<version>({_NUMBER})</version>",
}
"""Expressions whose group is the version, by file; in the firmware's header one for each part."""


def versions() -> dict[str, frozenset[str]]:
    """Return the versions that each file has, by its path in the repository."""
    found = {}
    for path, pattern in _files():
        numbers = re.findall(pattern, path.read_text(), re.MULTILINE)
        parts = [".".join(numbers)] if path.suffix == ".h" else numbers
        found[str(path.relative_to(ROOT))] = frozenset(parts)
    return found


def write(version: str) -> None:
    """Write a version into all files."""
    for path, pattern in _files():
        parts = iter(version.split("."))

        def replaced(found: re.Match[str], path: Path = path, parts: Iterator[str] = parts) -> str:
            number = next(parts) if path.suffix == ".h" else version
            start, end = found.start(1) - found.start(), found.end(1) - found.start()
            return f"{found[0][:start]}{number}{found[0][end:]}"

        path.write_text(re.sub(pattern, replaced, path.read_text(), flags=re.MULTILINE))


def _files() -> Iterator[tuple[Path, str]]:
    for name, pattern in PLACES.items():
        for path in sorted(ROOT.glob(name)):
            yield path, pattern


def main(words: list[str]) -> int:
    """Carry out the command line; return the exit status."""
    if words and not re.fullmatch(_NUMBER, words[0]):
        sys.stderr.write(f"{words[0]} is no version: three numbers, as 0.2.0\n")
        return 2
    if words:
        write(words[0])
    found = versions()
    one, *others = sorted(frozenset().union(*found.values()))
    if others or not all(found.values()):
        sys.stderr.write("".join(f"{name}: {', '.join(has)}\n" for name, has in found.items()))
        return 1
    sys.stdout.write(f"{one}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
