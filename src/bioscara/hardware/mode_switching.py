"""Switching of command modes: checked for all joints before any of them changes."""

from __future__ import annotations

from collections.abc import Sequence

from bioscara.errors import ModeSwitchError
from bioscara.hardware.axis import Axis
from bioscara.hardware.bus_budget import Capacity, highest_rate
from bioscara.hardware.command_modes import MOTION, Mode, resolve
from bioscara.hardware.interfaces import VELOCITY

Plan = list[tuple[Axis, Mode]]
"""The joints that change, and their new modes."""


def plan_modes(
    component: str, axes: Sequence[Axis], start: Sequence[str], stop: Sequence[str]
) -> Plan:
    """Return which joints change their mode.

    Args:
        component: Name of the component, for messages.
        axes: Its joints.
        start: Names of command interfaces that will be claimed; all exist.
        stop: Names of command interfaces that will be released; all exist.

    Raises:
        ModeSwitchError: Interfaces of one joint exclude one another, or one is claimed in addition
            to another that stays claimed.
    """
    plan: Plan = []
    for axis in axes:
        prefix = f"{axis.name}/"
        kept = axis.mode.value - {
            name.removeprefix(prefix) for name in stop if name.startswith(prefix)
        }
        new = {name.removeprefix(prefix) for name in start if name.startswith(prefix)}
        mode = resolve(component, axis.name, kept | new)
        if kept and new - kept:
            # A controller claims all its interfaces at once, so these would have two owners.
            raise ModeSwitchError(
                f"{axis.name}: {' and '.join(sorted(new - kept))} cannot be claimed while "
                f"{' and '.join(sorted(kept))} stays claimed: one controller moves a joint; claim "
                "both in one switch, or let the other go in it",
                component,
            )
        if mode is not axis.mode:
            plan.append((axis, mode))
    return plan


def check_modes(component: str, axes: Sequence[Axis], plan: Plan) -> None:
    """Raise unless every joint can take its new mode now.

    Raises:
        ModeSwitchError: One cannot; the message names it, the reason and the remedy.
    """
    homing = next((axis for axis in axes if axis.homing.running), None)
    for axis, mode in plan:
        if axis is homing and (mode is not Mode.NONE or axis.home_command.value):
            raise ModeSwitchError(
                f"{axis.name} is homing: command 0 to {axis.home_command.name} first", component
            )
        if mode is Mode.NONE:
            continue
        reason = axis.refusal(mode)
        if reason is not None:
            raise ModeSwitchError(f"{axis.name} cannot be commanded: {reason}", component)
        if mode not in MOTION:
            continue
        if homing is not None:
            raise ModeSwitchError(
                f"{axis.name} cannot be moved while {homing.name} is homing; wait for its end, "
                f"or command 0 to {homing.home_command.name}",
                component,
            )
        if not axis.homed:
            raise ModeSwitchError(
                f"{axis.name} is not homed: its position is unknown; home it first", component
            )
        if mode is Mode.TRACK and axis.joint.version < 2:
            raise ModeSwitchError(
                f"{axis.name} cannot take position and velocity together: that needs joint "
                "firmware of protocol 2; claim position alone",
                component,
            )


def check_capacity(component: str, axes: Sequence[Axis], plan: Plan, capacity: Capacity) -> None:
    """Raise if the bus cannot carry the cycles that result from a change.

    Positions are never refused: the rate is one at which the bus carries those of all joints.

    Raises:
        ModeSwitchError: It cannot; the message states their duration and the remedy.
    """
    becoming = dict(plan)
    modes = [(axis.joint, becoming.get(axis, axis.mode)) for axis in axes]
    bus_time = capacity.cycle_time(modes)
    highest = highest_rate(bus_time)
    driven = [joint for joint, mode in modes if mode is Mode.VELOCITY]
    if driven and highest < capacity.rate:
        both = all(joint.version == 2 for joint in driven)
        raise ModeSwitchError(
            f"{', '.join(joint.name for joint in driven)} by velocity alone: the exchanges of a "
            f"cycle would take {1e3 * bus_time:.2f} ms on this bus; it could carry {highest} Hz, "
            f"and the loop runs at {capacity.rate} Hz; claim "
            f"{'position and velocity together' if both else 'position'}, or fewer joints, or "
            "take a lower rate or a faster bus",
            component,
        )


def release_warnings(axes: Sequence[Axis], stop: Sequence[str], plan: Plan) -> list[str]:
    """Return warnings about releasing interfaces that are no reason to refuse it.

    Args:
        axes: The joints.
        stop: Names of command interfaces that will be released; all exist.
        plan: The resulting changes of mode.
    """
    warnings = []
    becoming = dict(plan)
    for axis in axes:
        prefix = f"{axis.name}/"
        claimed = axis.mode.value
        kinds = {name.removeprefix(prefix) for name in stop if name.startswith(prefix)}
        warnings += [
            f"{prefix}{kind} is released, but was not claimed" for kind in sorted(kinds - claimed)
        ]
        speed = axis.velocity_command.value
        left = becoming.get(axis, axis.mode) not in MOTION and axis.halted is None
        if VELOCITY in kinds & claimed and speed and left:
            warnings.append(
                f"{axis.velocity_command.name} is released while it commands {speed:g} "
                f"{axis.joint.parameters.unit}/s: {axis.name} is brought to rest; command 0 first"
            )
    return warnings


def check_homing(component: str, axes: Sequence[Axis], axis: Axis) -> None:
    """Raise unless ``axis`` can begin to home: all others are at rest and not commanded.

    Raises:
        ModeSwitchError: Another joint is homing or under command.
    """
    for other in axes:
        if other is not axis and (other.homing.running or other.mode in MOTION):
            doing = "homing" if other.homing.running else "under command"
            raise ModeSwitchError(
                f"{axis.name} cannot start homing while {other.name} is {doing}", component
            )
