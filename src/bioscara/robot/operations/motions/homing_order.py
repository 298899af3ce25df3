"""Choice of the joints to home, so that the hand does not sweep through the column during homing.

In the order of the parameters, from the lift to the elbow, no joint leads the hand into the arm
unless the elbow is folded when the wrist turns. That requires each joint to be at its end stop
before the next one begins. If some joints are homed already, two conditions are checked: whether
these are at the positions in which homing would have left them, and whether the elbow is folded.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from bioscara.errors import HomingError
from bioscara.hardware.axis import Axis

FOLDED = 2.4
"""Angle of the elbow [rad] from which on the wrist cannot turn over its full range: a jaw would
meet the column, on the meshes of the arm from 2.44 rad on, with the lift up and the jaws wide
open."""
BEFORE: Mapping[str, Sequence[str]] = {"j4": ("j2",), "j3": ("j2", "j4")}
"""Joints that must be at their end stops before a joint moves to its own."""
AT_STOP = {"rad": 0.1, "m": 0.05}
"""Distance from its end stop within which a joint counts as being there [rad or m]."""


def joints_to_home(axes: Sequence[Axis]) -> tuple[dict[str, float], list[str]]:
    """Return the joints to home, their directions and the reasons.

    Args:
        axes: All joints of the arm.

    Returns:
        The joints to home, each with a number whose sign is the direction; and a sentence for each
        of them that is homed and has to be homed again.

    Raises:
        HomingError: The elbow is known to be folded and the wrist's position is unknown.
    """
    by_name = {axis.name: axis for axis in axes}
    wanted = {axis.name for axis in axes if not axis.homed}
    _require_open_elbow(by_name, wanted)
    notes = []
    for name in sorted(wanted):
        for other in BEFORE.get(name, ()):
            axis = by_name[other]
            parameters = axis.joint.parameters
            off = abs(axis.position.value - parameters.home_position)
            if other not in wanted and not off <= AT_STOP[parameters.unit]:
                wanted.add(other)
                notes.append(
                    f"{other} is homed again, before {name}: it is {off:.3g} {parameters.unit} "
                    "from its end stop, where the hand could meet the arm"
                )
    directions = {
        name: axis.joint.parameters.homing.velocity
        for name, axis in by_name.items()
        if name in wanted
    }
    return directions, notes


def directions_of(
    axes: Sequence[Axis], order: Sequence[str], joints: Collection[str]
) -> dict[str, float]:
    """Return the directions for homing chosen joints, also those that are homed, and no others.

    Args:
        axes: All joints of the arm.
        order: Their names, in the order of homing.
        joints: Names of the joints to home.

    Raises:
        HomingError: Another joint has to be homed before, or the elbow is folded.
    """
    velocities = {axis.name: axis.joint.parameters.homing.velocity for axis in axes}
    for joint in joints:
        require_homing_of(axes, order, joint, velocities[joint], joints)
    return {name: velocity for name, velocity in velocities.items() if name in joints}


def require_homing_of(
    axes: Sequence[Axis],
    order: Sequence[str],
    joint: str,
    direction: float,
    together: Collection[str] = (),
) -> None:
    """Raise unless a joint may be homed alone, by the rules of homing all.

    Args:
        axes: All joints of the arm.
        order: Their names, in the order of homing.
        joint: Name of the joint.
        direction: Its sign is the direction of the homing.
        together: Names of the joints that are homed in the same homing, in that order.

    Raises:
        HomingError: The direction leads away from the end stop, another joint has to be homed
            before, or the elbow is folded.
    """
    by_name = {axis.name: axis for axis in axes}
    unknown = {axis.name for axis in axes if not axis.homed}
    missing = unknown.difference(together)
    velocity = by_name[joint].joint.parameters.homing.velocity
    if direction * velocity < 0.0:
        sign = "above" if velocity > 0.0 else "below"
        raise HomingError(
            f"{joint}: home command {direction:g} leads away from its end stop; give a number "
            f"{sign} 0",
            joint,
        )
    for other in order[: order.index(joint)]:
        if other in missing:
            raise HomingError(
                f"{joint} cannot be homed: {other} is not homed, and the hand could meet the arm; "
                f"home {other} first",
                joint,
            )
    if joint == "j4":
        _require_open_elbow(by_name, {joint, *unknown})
    for other in BEFORE.get(joint, ()):
        if other in together:
            continue
        parameters = by_name[other].joint.parameters
        off = abs(by_name[other].position.value - parameters.home_position)
        if not off <= AT_STOP[parameters.unit]:
            raise HomingError(
                f"{joint} cannot be homed: {other} is {off:.3g} {parameters.unit} from its end "
                f"stop, where the hand could meet the arm; home {other} first",
                joint,
            )


def _require_open_elbow(axes: Mapping[str, Axis], wanted: set[str]) -> None:
    elbow = axes["j3"]
    if "j4" in wanted and "j3" not in wanted and not abs(elbow.position.value) <= FOLDED:
        remedy = (
            "unfold() first, and home it then"
            if axes["j4"].homed
            else f"disable() the arm, open the elbow by hand to less than {FOLDED:g} rad and home "
            "again"
        )
        raise HomingError(
            f"j4 cannot be homed while the elbow is folded, j3 at {elbow.position.value:.3f} rad: "
            f"turning, the hand could meet the column; {remedy}"
        )
