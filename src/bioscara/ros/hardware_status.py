"""The hardware status of ``control_msgs``: a component with each of its joints as a device."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from control_msgs.msg import GenericHardwareState, HardwareDeviceStatus, HardwareStatus
from diagnostic_msgs.msg import KeyValue

from bioscara.api import messages as m
from bioscara.control.faults.kinds import ArmFault, FaultKind
from bioscara.ros import messages
from bioscara.ros.arm.control_tags import Component

State = GenericHardwareState
_POWER = {"active": State.POWER_ON, "inactive": State.POWER_STANDBY}
"""Power of components whose joints can be reached, by their lifecycle states."""
_LOST = (FaultKind.JOINT_LOST, FaultKind.BUS_STUCK, FaultKind.BUS_FAILED)
"""Faults after which a joint cannot be reached."""


class ArmHealth(NamedTuple):
    """The content of a status about the arm.

    Attributes:
        faults: Its faults.
        sources: The owner's names of all joints and components: faults of others are those of all.
        firmware: Versions of its joints, in words, by the owner's names.
        values: Values of its interfaces, by ``state_interface.JOINT/KIND``.
    """

    faults: Sequence[ArmFault]
    sources: frozenset[str]
    firmware: Mapping[str, str]
    values: Mapping[str, float]


def hardware_status(
    time: float, component: Component, value: m.ComponentValue, arm: ArmHealth
) -> HardwareStatus:
    """Return the status of a component.

    Args:
        time: Of the status [s].
        component: The component in the description.
        value: The component of the owner.
        arm: The arm's state from the owner.
    """
    header = messages.header(time)
    return HardwareStatus(
        header=header,
        hardware_id=component.name,
        hardware_device_states=[
            HardwareDeviceStatus(
                header=header, device_id=name, hardware_status=[_state(own, value, arm)]
            )
            for name, own in component.joints.items()
        ],
    )


def _state(joint: str, value: m.ComponentValue, arm: ArmHealth) -> GenericHardwareState:
    """Return the state of a joint; a fault that names no joint is one of all."""
    others = arm.sources - {joint, value.name}
    faults = [each for each in arm.faults if each.source not in others]
    reachable = value.state in _POWER
    lost = any(each.kind in _LOST for each in faults)
    unhomed = arm.values.get(f"state_interface.{joint}/home") == 0.0
    domains = [State.ERROR_HW] if faults else []
    domains += [State.CALIBRATION_REQUIRED] if reachable and unhomed else []
    health = State.HEALTH_OK if reachable else State.HEALTH_UNKNOWN
    connection = State.CONNECT_UP if reachable else State.CONNECT_UNKNOWN
    details = {"lifecycle_state": value.state, "faults": "; ".join(map(str, faults))}
    return GenericHardwareState(
        health_status=State.HEALTH_ERROR if faults else health,
        error_domain=domains or [State.ERROR_NONE],
        power_state=_POWER.get(value.state, State.POWER_UNKNOWN),
        connectivity_status=State.CONNECT_FAILURE if lost else connection,
        firmware_version=arm.firmware.get(joint, ""),
        state_details=[KeyValue(key=key, value=text) for key, text in details.items() if text],
    )
