"""The tree of errors drawn in errors.py and their numbers in docs/errors.md match the code."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from bioscara import errors


def drawn() -> dict[str, str]:
    """Return the parent of each error in the drawing, by name."""
    parents: dict[str, str] = {}
    path: list[str] = []
    for line in (errors.__doc__ or "").splitlines():
        names = re.match(r"    ((?:[│├└─ ]{4})*)(\w+Error(?:, \w+Error)*)", line)
        if names is None:
            continue
        depth = len(names[1]) // 4
        for name in names[2].split(", "):
            path[depth:] = [name]
            parents[name] = path[depth - 1] if depth else ""
    return parents


def public(kind: type) -> bool:
    return issubclass(kind, errors.BioscaraError) and not kind.__name__.startswith("_")


OURS: list[Any] = [
    each for each in vars(errors).values() if isinstance(each, type) and public(each)
]
ORIGINAL = {0, -1, -2, -3, -4, -5, -6, -101, -102, -109}
"""Numbers that the original driver returned."""


def listed() -> dict[str, int]:
    """Return the number of each error in the table of docs/errors.md."""
    page = (Path(__file__).parents[1] / "docs/errors.md").read_text()
    rows = re.findall(r"^\| (-?\d+) \|([^|]*)\|", page, re.M)
    assert {int(code) for code, _ in rows} >= ORIGINAL
    return {name: int(code) for code, names in rows for name in re.findall(r"`(\w+)`", names)}


def test_the_page_lists_the_number_of_each_error() -> None:
    assert listed() == {each.__name__: each.code for each in OURS}


def test_a_new_error_never_gets_a_number_of_the_original_driver() -> None:
    """Those that share one are of one kind there; each other one has a number of its own."""
    new = [each for each in OURS if "code" in vars(each) and each.code not in ORIGINAL]
    codes = [each.code for each in new]
    assert len(set(codes)) == len(codes)
    assert all(code <= -200 for code in codes)


def test_the_drawn_tree_of_errors_is_the_one_there_is() -> None:
    parents = {each: next(filter(public, each.__mro__[1:]), None) for each in OURS}
    assert drawn() == {
        each.__name__: parent.__name__ if parent else "" for each, parent in parents.items()
    }
