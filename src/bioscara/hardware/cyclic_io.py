"""Cyclic exchange between the arm and its joints, and removal of failed joints from it."""

from __future__ import annotations

from collections.abc import Sequence

from bioscara.clock import Clock
from bioscara.drivers import JointSample, drive, read_states, track
from bioscara.drivers.joint.cyclic import Outcome
from bioscara.errors import BioscaraError, BusStuckError, JointLostError
from bioscara.hardware.axis import HALTED, Axis
from bioscara.hardware.bus_watch import BusWatch
from bioscara.hardware.command_modes import Mode


class ArmExchange:
    """Requests and commands of an arm to its joints, each for several of them in one bus call.

    A joint that cannot continue is halted and reported; the others are not affected. A stuck bus
    halts all of them and is reported once; nothing is exchanged while ``stuck`` is set.

    Args:
        clock: Time of the bus.
        axes: All joints of the arm.
        watch: Distinguishes a stuck bus from lost joints.
        problems: List to which the errors are added.

    Attributes:
        enabled: Whether the joints should be enabled: one that is not has a problem.
        stuck: The stuck bus that was found; None while it works.
    """

    def __init__(
        self,
        clock: Clock,
        axes: Sequence[Axis],
        watch: BusWatch,
        problems: list[BioscaraError],
    ) -> None:
        self._clock, self._axes, self._watch, self._problems = clock, axes, watch, problems
        self._line = watch.line
        self.enabled = False
        self.stuck: BusStuckError | None = None

    def give_up(self, stuck: BusStuckError) -> None:
        """Halt all joints because the bus is stuck; they get nothing and stop autonomously."""
        self.stuck = stuck
        self._watch.remember_boots()
        for axis in self._axes:
            axis.halt(stuck)
            axis.forget()
            # Switching them off and on is what frees the line.
            axis.joint.session.expect_restart()

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
        if self._line.in_a_row and self._is_stuck(outcomes):
            return
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
        if self._line.in_a_row and self._is_stuck(outcomes):
            return
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

    def _is_stuck(self, outcomes: Sequence[Outcome]) -> bool:
        """Return whether these outcomes of a cycle show a stuck bus, and report it if so."""
        lost = any(isinstance(outcome, JointLostError) for outcome in outcomes)
        stuck = self._watch.stuck(lost=lost)
        if stuck is None:
            return False
        self.give_up(stuck)
        self._problems.append(stuck)
        return True

    def _halt(self, axis: Axis, reason: BioscaraError) -> None:
        if axis.halt(reason):
            self._problems.append(reason)
