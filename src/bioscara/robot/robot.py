"""The arm as one object."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

from bioscara.bus import Bus
from bioscara.bus.select import open_bus
from bioscara.clock import Clock, MonotonicClock
from bioscara.control.faults import Fault
from bioscara.control.joint_state_broadcaster import JointStates
from bioscara.control.joint_trajectory import Goal, JointTrajectory, Status
from bioscara.drivers import Joint
from bioscara.errors import (
    BioscaraError,
    GoalAbortedError,
    HomingError,
    MotionCancelledError,
    NotHomedError,
    TrajectoryError,
)
from bioscara.hardware import ArmHardware, State
from bioscara.hardware.stopping import stop_and_disable
from bioscara.model import ArmParameters, load_parameters
from bioscara.planning import Trajectory, check, ramp
from bioscara.report import CycleRecord, Phase
from bioscara.robot.pacing import PacedClock
from bioscara.robot.records import Cancelled, Observe, Recorder
from bioscara.robot.stack import BROADCASTER, HOLD, HOMING, TRAJECTORY, Stack

SETTLING = 0.3
"""How long the end of a trajectory is held, so that the arm is seen to rest there [s]."""
START_TOLERANCE = {"rad": math.radians(1.0), "m": 2e-3}
"""How far from its start a trajectory may find the arm: from there it is joined by a ramp."""
_REST_TIME = 10.0
"""Longest time for coming to rest [s]."""


def _ignore(record: CycleRecord) -> None:
    pass


def _never() -> bool:
    return False


class Robot:
    """A Bioscara arm.

    Used as a context manager: entering opens the bus and greets the joints, and nothing moves;
    leaving stops and disables them all, whatever happened. Every method returns when what it
    started has ended; only :meth:`stop` may be called from another thread meanwhile.

    Args:
        bus: What the joints are on; closed in the end.
        clock: The arm's time.
        parameters: The arm as data.
        description: Which arm on which bus, in words.
        rate: Control cycles per second [Hz]; None for what suits the joints.
        evidence: Folder for the flight records of faults.
        pace_homing: Whether simulated homing is held back to real time.
        pace_motion: Whether simulated motion is held back to real time.

    Attributes:
        bus: What the joints are on.
        clock: The arm's time.
        parameters: The arm as data.
        description: Which arm on which bus, in words.
    """

    def __init__(
        self,
        bus: Bus,
        clock: Clock,
        parameters: ArmParameters,
        description: str,
        *,
        rate: int | None = None,
        evidence: Path = Path("faults"),
        pace_homing: bool = False,
        pace_motion: bool = False,
    ) -> None:
        self.parameters, self.clock, self.description = parameters, clock, description
        self.bus = bus
        self._arm = ArmHardware("bioscara_arm", bus, clock, parameters.joints)
        self._pace_homing, self._pace_motion = pace_homing, pace_motion
        self._rate, self._evidence = rate, evidence
        self._stack: Stack | None = None
        self._stopping = threading.Event()
        self._begin = clock.now()
