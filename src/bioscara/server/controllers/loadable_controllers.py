"""Names, types and parameters of the controllers that clients may load."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from bioscara.arguments import shown
from bioscara.control.controllers.controller import AnyController
from bioscara.control.controllers.gripper_action_controller import (
    GripperActionController,
    GripperActionParameters,
)
from bioscara.control.controllers.hold_controller import HoldController
from bioscara.control.controllers.homing_controller import HomingController
from bioscara.control.controllers.jog_controller import JogController
from bioscara.control.controllers.joint_state_broadcaster import JointStateBroadcaster
from bioscara.control.controllers.joint_trajectory import JointTrajectoryController
from bioscara.control.manager.registry import TYPES
from bioscara.control.manager.switch_request import unknown
from bioscara.errors import ConfigurationError, SwitchError
from bioscara.hardware import GripperHardware
from bioscara.robot.connection.stack import OWN, Stack

LOADED = 32
"""Largest number of controllers of clients."""
CLIENT_TYPES = tuple(
    kind for kind, made in TYPES.items() if made not in (HoldController, JogController)
)
"""Types that clients may load: the others obey only operations."""
_LISTED = 32
"""Largest number of names in a list of parameters."""
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,63}")


def require_client(name: str) -> None:
    """Raise if a controller is one of the arm's own.

    Raises:
        SwitchError: It is.
    """
    if name.startswith(OWN):
        raise SwitchError(
            f"{shown(name)} is the arm's own controller, which its operations use; load another "
            "one of that type under another name"
        )


def made_controller(stack: Stack, name: str, kind: str, values: Mapping[str, Any]) -> AnyController:
    """Return a new controller of a client; may be called in any thread.

    Args:
        stack: The control stack.
        name: Its name.
        kind: Its type.
        values: Its parameters; those that the arm prescribes are added.

    Raises:
        SwitchError: The name or the type cannot be used.
        ConfigurationError: A parameter cannot be used.
    """
    require_client(name)
    if not _NAME.fullmatch(name):
        raise SwitchError(
            f"a controller cannot be named {shown(name)}; give 1 to 64 letters, digits and "
            "underscores, the first no digit"
        )
    if kind not in CLIENT_TYPES:
        raise SwitchError(unknown(kind, CLIENT_TYPES, "controller type"))
    controller = stack.manager.make(name, kind, _completed(stack, kind, values))
    _require_names(stack, controller)
    if isinstance(controller, GripperActionController):
        _require_limits(name, controller.parameters, stack.gripper.parameters)
    return controller


def _completed(stack: Stack, kind: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return parameters, with those of the arm's own controller of that type as defaults."""
    given = dict(values)
    if kind == HomingController.TYPE:
        return _with_homing_limits(stack, given)
    if kind == GripperActionController.TYPE:
        own = stack.gripper.parameters
        if given.get("limits") is None:
            given["limits"] = own.limits
        given.setdefault("velocity_limit", own.velocity_limit)
    elif kind == JointTrajectoryController.TYPE:
        return _with_ramps(stack, given)
    elif kind == JointStateBroadcaster.TYPE:
        given.setdefault("joints", [axis.name for axis in stack.hardware.axes])
    return given


def _with_ramps(stack: Stack, given: dict[str, Any]) -> dict[str, Any]:
    """Return parameters of a trajectory controller, with the arm's ramps to rest as defaults."""
    own, constraints = stack.trajectory.parameters.constraints, given.get("constraints", {})
    joints = given.get("joints")
    if not isinstance(constraints, Mapping) or not isinstance(joints, list | tuple):
        # Refused with the other checks.
        return given
    ramps = {
        joint: {"max_deceleration_on_cancel": limits.max_deceleration_on_cancel, **mine}
        for joint, limits in own.joints.items()
        if joint in joints and isinstance(mine := constraints.get(joint, {}), Mapping)
    }
    usual = {
        "decelerate_on_cancel": own.decelerate_on_cancel,
        "least_time_on_cancel": own.least_time_on_cancel,
    }
    return {**given, "constraints": {**usual, **constraints, **ramps}}


def _with_homing_limits(stack: Stack, given: dict[str, Any]) -> dict[str, Any]:
    """Return parameters of homing, with the limits of the arm's own where none are given."""
    own = stack.homing.parameters
    travel = dict(zip(own.joints, own.max_travel, strict=True))
    try:
        arranged = dict(type(own).arranged(given))
    except ValueError:
        # Refused with the other checks, as are unknown joints.
        return given
    joints = arranged.get("joints")
    known = isinstance(joints, list | tuple) and all(
        isinstance(joint, str) and joint in travel for joint in joints
    )
    limits = {"max_travel": [travel[joint] for joint in joints]} if known and joints else {}
    return {"timeout": own.timeout, **limits, **arranged}


def _require_names(stack: Stack, controller: AnyController) -> None:
    """Raise unless the joints of a controller are those that it may use, none of them twice."""
    parameters, name = controller.parameters, controller.name
    joints = tuple(axis.name for axis in stack.hardware.axes)
    jaws = tuple(
        handle.joint
        for component in stack.manager.components
        if isinstance(component, GripperHardware)
        for handle in component.commands.values()
    )
    if isinstance(controller, GripperActionController):
        _require_known(f"{name}: joint", (parameters.joint,), jaws)
        return
    reads = isinstance(controller, JointStateBroadcaster)
    _require_known(f"{name}: joints", parameters.joints, (*joints, *jaws) if reads else joints)
    for what in ("extra_joints", "fallback_controllers"):
        listed = getattr(parameters, what, ())
        if len(listed) > _LISTED:
            raise ConfigurationError(
                f"{name}: {what} has {len(listed)} names; give at most {_LISTED}"
            )
    for fallback in parameters.fallback_controllers:
        require_client(fallback)


def _require_limits(
    name: str, given: GripperActionParameters, own: GripperActionParameters
) -> None:
    """Raise if limits of the jaws are wider than those of the arm's own controller."""
    if given.limits is not None and own.limits is not None:
        (lower, upper), (least, most) = given.limits, own.limits
        if lower < least or upper > most:
            raise ConfigurationError(
                f"{name}: limits {lower:g} .. {upper:g} m are wider than those of the arm; give "
                f"some within {least:g} .. {most:g} m"
            )
    if given.velocity_limit > own.velocity_limit:
        raise ConfigurationError(
            f"{name}: velocity_limit {given.velocity_limit:g} m/s is above that of the arm; give "
            f"at most {own.velocity_limit:g} m/s"
        )


def _require_known(what: str, given: Sequence[str], known: Sequence[str]) -> None:
    for joint in given:
        if joint not in known:
            raise ConfigurationError(
                f"{what}: {shown(joint)} is none of {', '.join(known)}; name some of these"
            )
    if len(set(given)) != len(given):
        raise ConfigurationError(f"{what}: a joint is named twice in {shown(list(given))}")
