"""Cyclic exchange between the arm and its joints, and removal of failed joints from it."""

from __future__ import annotations

from collections.abc import Sequence

from bioscara.clock import Clock
from bioscara.drivers import JointSample, drive, read_states, track
from bioscara.drivers.joint.cyclic import Outcome
from bioscara.errors import BioscaraError
from bioscara.hardware.axis import HALTED, Axis
from bioscara.hardware.command_modes import Mode


class ArmExchange:
    """Requests and commands of an arm to its joints, each for several of them in one bus call.

    A joint that cannot continue is halted and reported; the others are not affected.

    Args:
        clock: Time of the bus.
        problems: List to which the joints' errors are added.

    Attributes:
        enabled: Whether the joints should be enabled: one that is not has a problem.
    """

    def __init__(self, clock: Clock, problems: list[BioscaraError]) -> None:
        self._clock, self._problems = clock, problems
        self.enabled = False

    def request_states(self, axes: Sequence[Axis]) -> None:
        """Request the state of joints."""
        start = self._clock.now()
        outcomes = read_states([axis.joint for axis in axes], retry=True)
        self._store(axes, outcomes, start)

    def send_positions(self, axes: Sequence[Axis], time: float, period: float) -> None:
        """Send joints their positions; they answer with their state.

        Args:
            axes: The joints.
            time: Start of the cycle [s].
            period: Time from cycle to cycle [s].
        """
        start = self._clock.now()
        joints, setpoints = [], []
        for axis in axes:
            joints.append(axis.joint)
            setpoints.append(axis.setpoint(period))
        self._store(axes, track(joints, setpoints, retry=True), start, time)

    def send_velocities(self, axes: Sequence[Axis]) -> None:
        """Send joints their velocities; they answer only with their flags."""
        velocities = [axis.velocity_command.value for axis in axes]
        outcomes = drive([axis.joint for axis in axes], velocities, retry=True)
        for axis, outcome in zip(axes, outcomes, strict=True):
            if isinstance(outcome, BioscaraError):
                axis.mark_missed(outcome)
                self._halt(axis, outcome)
            elif HALTED[outcome.flags]:
                self._on_halted(axis)

    def _store(
        self,
        axes: Sequence[Axis],
        outcomes: Sequence[Outcome],
        start: float,
        cycle_start: float | None = None,
    ) -> None:
        """Store the joints' answers; ``cycle_start`` is given if they answer to setpoints."""
        # One bus call carries all frames, one after the other and all of the same length.
        share = (self._clock.now() - start) / len(axes)
        stamp = start
        for axis, outcome in zip(axes, outcomes, strict=True):
            stamp += share
            # isinstance() is fast where it is true: here, in the ordinary case.
            if not isinstance(outcome, JointSample):
                axis.mark_missed(outcome)
                self._halt(axis, outcome)
                continue
            axis.store(outcome, stamp)
            if cycle_start is None:
                axis.answered = False
            else:
                axis.answered, axis.arrival = True, stamp - cycle_start
            if HALTED[outcome.flags]:
                self._on_halted(axis)

    def _on_halted(self, axis: Axis) -> None:
        """Halt a joint that does not follow; one that is to home is enabled by homing."""
        if self.enabled and axis.halted is None and axis.mode is not Mode.HOME:
            self._halt(axis, axis.why_halted())

    def _halt(self, axis: Axis, reason: BioscaraError) -> None:
        if axis.halt(reason):
            self._problems.append(reason)
