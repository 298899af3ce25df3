"""The parameters of an arm as a table, and changes of its overlay."""

from __future__ import annotations

import inspect
import io
import re
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import msgspec

from bioscara.arguments import shown
from bioscara.errors import InvalidArgumentError
from bioscara.model import ArmParameters
from bioscara.model.loading import existing_file
from bioscara.model.overlay import FIXED, Overlay, changes
from bioscara.model.parameters import UNITS
from bioscara.model.validation import Location, dotted
from bioscara.model.yaml_file import YamlFile
from bioscara.spelling import did_you_mean

_SOURCE = "overlay"
"""Name of the overlay in messages."""
_DERIVED = frozenset({"name"})
"""Fields that are no values of the file."""
_MOST = 1000
"""Largest number of changes at once; the arm has a tenth of it."""

Json = None | bool | int | float | str | list[Any] | dict[str, Any]


class ParameterRow(msgspec.Struct, frozen=True):
    """A parameter.

    Attributes:
        name: Its dotted name, as in the file.
        value: Its value with the overlay.
        default: That of the existing arms.
        unit: Its unit; empty without one.
        source: ``overlay`` where the overlay has it, else ``default``.
        text: Its meaning.
        fixed: Why an overlay cannot change it, or null.
    """

    name: str
    value: Json
    default: Json
    unit: str
    source: str
    text: str
    fixed: str | None


class ParameterTable(msgspec.Struct, frozen=True):
    """The parameters of an arm.

    Attributes:
        revision: Number of the overlay, for ``set_parameters``.
        restart: Whether it was changed since the owner began, which applies it when it starts.
        overlay: Its text.
        rows: The parameters, in the order of the file.
    """

    revision: int
    restart: bool
    overlay: str
    rows: tuple[ParameterRow, ...]


class ParameterChange(msgspec.Struct, frozen=True):
    """A value that a change changes.

    Attributes:
        name: Its dotted name.
        before: The value before.
        after: The value after.
        unit: Their unit; empty without one.
    """

    name: str
    before: Any
    after: Any
    unit: str


class ParameterDraft(msgspec.Struct, frozen=True):
    """A new overlay, checked and not yet written.

    Attributes:
        overlay: Its text, for ``set_parameters``.
        revision: Number of the overlay that it replaces.
        diff: The values that it changes.
    """

    overlay: str
    revision: int
    diff: tuple[ParameterChange, ...]


class ParameterChanges(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Values to change.

    Attributes:
        changes: By dotted name; null removes the value from the overlay.
    """

    changes: dict[str, Json]


class _Leaf(NamedTuple):
    """A value with its place and description."""

    location: Location
    value: Any
    unit: str
    text: str


def parameter_rows(overlay: str) -> tuple[ParameterRow, ...]:
    """Return the parameters of an arm with an overlay.

    Raises:
        ConfigurationError: The overlay cannot be used.
    """
    given = YamlFile(overlay, _SOURCE)
    defaults = [leaf.value for leaf in _leaves(_merged(YamlFile("", _SOURCE)))]
    return tuple(
        ParameterRow(
            dotted(leaf.location),
            leaf.value,
            default,
            leaf.unit,
            "overlay" if _has(given.values, leaf.location) else "default",
            leaf.text,
            FIXED.get(leaf.location),
        )
        for leaf, default in zip(_leaves(_merged(given)), defaults, strict=True)
    )


def drafted(overlay: str, changed: Mapping[str, Json]) -> tuple[str, tuple[ParameterChange, ...]]:
    """Return an overlay with changes, and the changed values.

    Comments and order of the overlay stay.

    Args:
        overlay: Text of the overlay now.
        changed: Values by dotted name; None removes one from the overlay.

    Returns:
        The new text, and the values that differ.

    Raises:
        InvalidArgumentError: There is no parameter of such a name.
        ConfigurationError: The new overlay, or the one now, cannot be used; the message names the
            value and its limit.
    """
    if len(changed) > _MOST:
        raise InvalidArgumentError(f"{len(changed)} changes at once; at most {_MOST} are taken")
    file = YamlFile(overlay, _SOURCE)
    before = _merged(file)
    leaves = {dotted(leaf.location): leaf for leaf in _leaves(before)}
    # A file of comments alone has no values, and keeps its comments.
    head, values = (overlay, {}) if file.values is None else ("", file.values)
    for name, value in changed.items():
        if name not in leaves:
            hint = did_you_mean(name, leaves, "GET /api/parameters lists them")
            raise InvalidArgumentError(f"there is no parameter {shown(name)}; {hint}")
        _set(values, leaves[name].location, value)
    if head and not head.endswith("\n"):
        head += "\n"
    text = head + (_written(values) if values else "")
    after = _merged(YamlFile(text, _SOURCE))
    diff = tuple(
        ParameterChange(change.name, change.before, change.after, leaves[change.name].unit)
        for change in changes(before, after)
    )
    return text, diff


def _merged(overlay: YamlFile) -> ArmParameters:
    both = Overlay(existing_file(), overlay)
    return ArmParameters.checked(both.values, both.place, contradicted=True)


def _leaves(parameters: ArmParameters) -> Iterator[_Leaf]:
    """Yield the values, the arm's own first, then those of the joints and of the other groups."""
    for name, value in _members(parameters):
        if name == "joints":
            for joint in value:
                yield from _within(joint, ("joints", joint.name))
        elif is_dataclass(value):
            yield from _within(value, (name,))
        else:
            yield _leaf(parameters, name, value, (name,))


def _within(group: Any, location: Location) -> Iterator[_Leaf]:
    for name, value in _members(group):
        here = (*location, name)
        if is_dataclass(value):
            yield from _within(value, here)
        else:
            yield _leaf(group, name, value, here)


def _members(group: Any) -> Iterator[tuple[str, Any]]:
    for each in fields(group):
        if each.name not in _DERIVED:
            yield each.name, getattr(group, each.name)


def _leaf(group: Any, name: str, value: Any, location: Location) -> _Leaf:
    unit, text = _descriptions(inspect.getdoc(type(group)) or "").get(name, ("", ""))
    joint = next((key for key in reversed(location) if key in UNITS), None)
    if joint is not None:
        unit = re.sub(r"\bunit\b", UNITS[str(joint)], unit)
    if name.endswith("_percent"):
        unit = "%"
    return _Leaf(location, value, unit, text)


@lru_cache(maxsize=32)
def _descriptions(docstring: str) -> dict[str, tuple[str, str]]:
    """Return unit and meaning of each field of a group, as its docstring has them."""
    _, _, listed = docstring.partition("Attributes:\n")
    found = {}
    for name, lines in re.findall(r"^ {4}(\w+): (.*(?:\n {8}.*)*)", listed, re.MULTILINE):
        text = " ".join(lines.split()).replace("``", "")
        unit = re.search(r" \[([^\]]+)\]", text)
        if unit is not None:
            text = text.replace(unit[0], "", 1)
        found[name] = ("" if unit is None else unit[1], text)
    return found


def _has(node: Any, location: Location) -> bool:
    for key in location:
        if not isinstance(node, dict) or key not in node:
            return False
        node = node[key]
    return True


def _set(values: Any, location: Location, value: Json) -> None:
    """Set a value of nested mappings, or remove it, with the mappings that it leaves empty."""
    *groups, name = location
    trail = [values]
    for key in groups:
        inner = trail[-1].get(key)
        if not isinstance(inner, dict):
            if value is None:
                return
            inner = trail[-1][key] = {}
        trail.append(inner)
    if value is not None:
        trail[-1][name] = value
        return
    trail[-1].pop(name, None)
    for outer, key in zip(reversed(trail[:-1]), reversed(groups), strict=True):
        if not outer[key]:
            del outer[key]


def _written(values: Any) -> str:
    # Imported only when something is changed: it loads slowly.
    from ruamel.yaml import YAML  # noqa: PLC0415

    stream = io.StringIO()
    yaml = YAML(typ="rt")
    yaml.width = 1000
    yaml.dump(values, stream)
    return stream.getvalue()
