"""The tree of errors drawn in errors.py matches the code."""

from __future__ import annotations

import re

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


def test_the_drawn_tree_of_errors_is_the_one_there_is() -> None:
    ours = [each for each in vars(errors).values() if isinstance(each, type) and public(each)]
    parents = {each: next(filter(public, each.__mro__[1:]), None) for each in ours}
    assert drawn() == {
        each.__name__: parent.__name__ if parent else "" for each, parent in parents.items()
    }
