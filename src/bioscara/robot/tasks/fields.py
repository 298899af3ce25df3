"""The values of a task: range, unit and check are declared with the type of a field.

msgspec compares ranges only where it reads a message, and reports the first problem alone. Here the
check is kept in the metadata of the field, so that a program, a message and a step of a sequence
get the same sentence; range and unit are also in the JSON Schema.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from typing import Annotated, Any, get_args

import msgspec
from msgspec import Meta

from bioscara.arguments import flag, items, number, shown, text
from bioscara.errors import InvalidArgumentError, LimitError, TrajectoryError
from bioscara.kinematics import Pose
from bioscara.kinematics.pose import ANGLE_MAX, PLACE_MAX, require_near, require_near_place
from bioscara.planning.limits import SLOWEST, check_share
from bioscara.robot.workspace.load import Load
from bioscara.robot.workspace.tools import OFFSET_MAX

Check = Callable[[str, Any], object]
"""Returns a value as the task keeps it, for the name of its field; raises an InvalidArgumentError
if it cannot be used."""

_CHECK = "check"


def checked_by(check: Check, **schema: object) -> Meta:
    """Return the metadata of a field.

    Args:
        check: Its check.
        schema: What the JSON Schema says besides the type.
    """
    return Meta(extra={_CHECK: check}, extra_json_schema=schema or None)


def within(lower: float, upper: float, unit: str, remedy: str = "") -> Meta:
    """Return the metadata of a number.

    Args:
        lower: Smallest value.
        upper: Largest value.
        unit: Its unit.
        remedy: What to give instead, for the message.
    """

    def check(name: str, value: object) -> float:
        given = number(name, value)
        if not lower <= given <= upper:
            raise LimitError(name, given, lower, upper, unit, remedy)
        return given

    return checked_by(check, minimum=lower, maximum=upper, **{"x-unit": unit})


def check_fields(value: msgspec.Struct) -> None:
    """Check the fields of a struct, and keep what the checks return.

    Raises:
        InvalidArgumentError: A value cannot be used; the message names the field.
    """
    for name, check in _checks(type(value)):
        given = getattr(value, name)
        if given is None:
            continue
        if (kept := check(name, given)) is not given:
            msgspec.structs.force_setattr(value, name, kept)


@cache
def _checks(kind: type[msgspec.Struct]) -> tuple[tuple[str, Check], ...]:
    fields = msgspec.structs.fields(kind)
    return tuple((each.name, check) for each in fields for check in _checks_of(each.type))


def _checks_of(kind: Any) -> Iterator[Check]:
    for meta in getattr(kind, "__metadata__", ()):
        if isinstance(meta, Meta) and meta.extra is not None:
            yield meta.extra[_CHECK]
    # Those of a value that may be left out are within the union with None.
    if type(None) in get_args(kind):
        for inner in get_args(kind):
            yield from _checks_of(inner)


def _pose_or_name(require: Callable[[str, object], Pose], what: str) -> Check:
    def check(_: str, value: object) -> Pose | str:
        return value if isinstance(value, str) and value else require(what, value)

    return check


def _positions(_: str, value: object) -> tuple[Any, ...]:
    remedy = "give one for each joint, or a pose to move_to()"
    if isinstance(value, Pose):
        raise TrajectoryError(f"the positions of the joints are {shown(value)}; {remedy}")
    # The planner, which knows their names, checks each.
    return items("the positions of the joints", value, remedy, error=TrajectoryError)


def _load(_: str, value: object) -> Load:
    if not isinstance(value, Load):
        raise InvalidArgumentError(f"the load is {shown(value)}; give Load(name, shape)")
    return value


def waypoints(_: str, value: object) -> tuple[Any, ...]:
    """Return waypoints as a tuple; the planner checks each."""
    return items("the waypoints", value, "give a list of Waypoint(pose)")


Share = Annotated[
    float, checked_by(lambda name, value: check_share(value, name), minimum=SLOWEST, maximum=1.0)
]
"""A share of the limits."""
Displacement = Annotated[float, within(-PLACE_MAX, PLACE_MAX, "m", "are these millimetres?")]
"""A displacement along an axis."""
Turn = Annotated[float, within(-ANGLE_MAX, ANGLE_MAX, "rad", "are these degrees?")]
"""A rotation about the vertical."""
Width = Annotated[float, within(0.0, OFFSET_MAX, "m", "give a width between these, in metres")]
"""A width between the jaws, or a part of one."""
Target = Annotated[Pose | str, checked_by(_pose_or_name(require_near, "the goal"))]
"""A pose of the tool: by its numbers, or by its name in the teach table."""
Via = Annotated[Pose | str, checked_by(_pose_or_name(require_near_place, "the via"))]
"""Likewise; its yaw is not used."""
Name = Annotated[str, checked_by(text)]
"""A name of the teach table."""
Flag = Annotated[bool, checked_by(flag)]
"""True or false."""
Positions = Annotated[tuple[float, ...], checked_by(_positions)]
"""A position of each joint."""
ALoad = Annotated[Load, checked_by(_load)]
"""An object that the arm carries."""
