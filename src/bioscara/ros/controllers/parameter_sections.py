"""The sections of parameter files: rclpy does not tell from which one a value comes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

_PARAMETERS = "ros__parameters"


def sections(words: Sequence[str]) -> dict[str, frozenset[str]]:
    """Return which parameters the arguments of a node have for which node.

    Args:
        words: Arguments of ROS; files in them have been accepted by rclpy.

    Returns:
        Names of parameters, with dots, by the full name of the node, or by the wildcard.
    """
    found: dict[str, set[str]] = {}
    for word, value in pairwise(words):
        if word == "--params-file":
            given = _of_file(Path(value))
        elif word in ("-p", "--param"):
            node, _, name = value.partition(":=")[0].rpartition(":")
            given = iter([(node or "/**", name)])
        else:
            continue
        for section, name in given:
            found.setdefault(f"/{section.lstrip('/')}", set()).add(name)
    return {section: frozenset(names) for section, names in found.items()}


def _of_file(path: Path) -> Iterator[tuple[str, str]]:
    """Yield each section with the name of a parameter in it."""
    # Imported here: it loads slowly, and a node without arguments reads no file.
    from ruamel.yaml import YAML  # noqa: PLC0415

    yaml = YAML(typ="safe")
    yaml.allow_duplicate_keys = True
    return _below("", yaml.load(path))


def _below(above: str, tree: Any) -> Iterator[tuple[str, str]]:
    for key, value in tree.items() if isinstance(tree, Mapping) else ():
        if key == _PARAMETERS:
            yield from ((above, name) for name in _names("", value))
        else:
            yield from _below(f"{above}/{str(key).strip('/')}", value)


def _names(above: str, value: Any) -> Iterator[str]:
    if isinstance(value, Mapping):
        for key, each in value.items():
            yield from _names(f"{above}.{key}" if above else str(key), each)
    elif isinstance(value, list) and value and isinstance(value[0], Mapping):
        # As rcl reads a list of mappings.
        for each in value:
            yield from _names(above, each)
    else:
        yield above
