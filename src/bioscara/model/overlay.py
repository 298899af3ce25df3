"""Values of one arm, such as its calibration, over those of a complete parameter file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from typing import Any, NamedTuple

from bioscara.arguments import shown
from bioscara.errors import ConfigurationError
from bioscara.model.parameters import JOINTS, ArmParameters
from bioscara.model.validation import Location, dotted
from bioscara.model.yaml_file import YamlFile

DRAWN = "upper_arm", "forearm", "tool_mass"
"""Values of the geometry that the description's meshes and masses are made from."""
REBUILD = (
    "the meshes and masses of the description are made from it; change parameters.yaml in a "
    "checkout and run make generate"
)
"""Why an arm with other values of these has no description."""
_CHECKED = (
    "the arm was checked to home without touching itself in the committed order and directions "
    "only; an arm of another design has a complete file of its own"
)
FIXED: Mapping[Location, str] = {
    **{
        ("joints", name, "address"): "it belongs to the number of the joint's firmware image; "
        "flash the board with the image of its joint"
        for name in JOINTS
    },
    ("homing_order",): _CHECKED,
    **{("geometry", name): REBUILD for name in DRAWN},
}
"""Values that an overlay cannot change, and the reasons."""
_MISSING = object()


class Overlay:
    """A parameter file with the values of another one over it.

    Mappings are merged; all other values, also lists, replace the file's.

    Attributes:
        values: Of both; for ``Checked.checked``.

    Raises:
        ConfigurationError: The overlay changes a value that must be the file's.
    """

    def __init__(self, file: YamlFile, overlay: YamlFile) -> None:
        self._file, self._overlay = file, overlay
        given = {} if overlay.values is None else overlay.values
        self.values = _merged(file.values, given)
        problems = list(self._fixed())
        if problems:
            raise ConfigurationError("; also ".join(problems))

    def place(self, location: Location) -> str:
        """Return the begin of a message about a value: its file and line.

        A value of neither file has those of its group, in the overlay if that is there.
        """
        overlaid = self._overlay.values is not None and _covers(self._overlay.values, location)
        return (self._overlay if overlaid else self._file).place(location)

    def _fixed(self) -> Iterator[str]:
        """Yield a sentence for each value that cannot be changed and differs from the file's."""
        for location, reason in FIXED.items():
            if not _same(_at(self.values, location), _at(self._file.values, location)):
                yield f"{self.place(location)}{dotted(location)} cannot be overlaid: {reason}"
        for name in JOINTS:
            location = "joints", name, "homing", "velocity"
            values = _at(self.values, location), _at(self._file.values, location)
            if _sign(values[0]) * _sign(values[1]) < 0:
                place = f"{self.place(location)}{dotted(location)}"
                yield f"{place}: the sign cannot be overlaid: {_CHECKED}"


def _merged(values: Any, over: Any) -> Any:
    if not (isinstance(values, dict) and isinstance(over, dict)):
        return over
    changed = {key: _merged(values[key], over[key]) if key in values else over[key] for key in over}
    return {**values, **changed}


def _covers(node: Any, location: Location) -> bool:
    """Return whether a value, or a list or number in its stead, is in the overlay."""
    for key in location:
        if not isinstance(node, dict):
            break
        if key not in node:
            return False
        node = node[key]
    return True


def _at(node: Any, location: Location) -> Any:
    for key in location:
        if not (isinstance(node, dict) and key in node):
            return _MISSING
        node = node[key]
    return node


def _same(value: Any, other: Any) -> bool:
    """Return whether two values are the same, or one of them is refused by its own check."""
    return _MISSING in (value, other) or bool(value == other)


def _sign(value: Any) -> int:
    return (value > 0) - (value < 0) if isinstance(value, int | float) else 0


class Change(NamedTuple):
    """A value that differs between two arms.

    Attributes:
        name: Its dotted name, as in an error.
        before: The value of the one.
        after: The value of the other.
    """

    name: str
    before: object
    after: object

    def __str__(self) -> str:
        return f"{self.name} ({shown(self.before)} to {shown(self.after)})"


def changes(before: ArmParameters, after: ArmParameters) -> tuple[Change, ...]:
    """Return the values in which two arms differ, in the order of the file."""
    joints = zip(before.joints, after.joints, strict=True)
    found = [change for one, other in joints for change in _changes(one, other, "joints", one.name)]
    rest = [
        change
        for field in fields(ArmParameters)
        if field.name != "joints"
        for change in _changes(getattr(before, field.name), getattr(after, field.name), field.name)
    ]
    return (*found, *rest)


def _changes(before: Any, after: Any, *location: str) -> Iterator[Change]:
    if is_dataclass(before):
        for field in fields(before):
            values = getattr(before, field.name), getattr(after, field.name)
            yield from _changes(*values, *location, field.name)
    elif before != after:
        yield Change(dotted(location), before, after)
