"""Generated files: each program that makes some writes them, or compares them with ``--check``."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from bioscara.errors import ConfigurationError

ROOT = Path(__file__).parents[1]


def update(
    wanted: Mapping[Path, str | bytes], *, check: bool, there: Iterable[Path] = ()
) -> list[Path]:
    """Write the files that are not as wanted, and remove those that are not wanted.

    Args:
        wanted: The content of each file.
        check: Whether to change nothing.
        there: Files that are generated, wanted or not.

    Returns:
        The files that were outdated, or that are no longer generated.
    """
    stale = []
    for path, text in wanted.items():
        content = text.encode() if isinstance(text, str) else text
        if path.is_file() and path.read_bytes() == content:
            continue
        stale.append(path)
        if not check:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
    superfluous = sorted({*there} - {*wanted})
    for path in superfluous if not check else ():
        path.unlink()
    return [*stale, *superfluous]


def main(write: Callable[[bool], list[Path]], arguments: list[str] | None = None) -> int:
    """Write or check files; return the exit status.

    Args:
        write: Brings them up to date, or changes nothing; returns those that were outdated.
        arguments: Of the command line; None for those of this process.
    """
    parser = argparse.ArgumentParser()
    parser.add_argument("--check", action="store_true", help="write nothing, fail when stale")
    check = parser.parse_args(arguments).check
    try:
        stale = write(check)
    except ConfigurationError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    names = [str(path).removeprefix(f"{ROOT}/") for path in stale]
    if check and names:
        sys.stderr.write(f"{', '.join(names)}: stale; run make generate\n")
        return 1
    for name in names:
        sys.stdout.write(f"wrote {name}\n")
    return 0
