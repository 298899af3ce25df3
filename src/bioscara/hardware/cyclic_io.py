"""What the arm and its joints say to each other in a cycle, and which joints drop out of it."""

from __future__ import annotations

from collections.abc import Sequence

from bioscara.clock import Clock
from bioscara.drivers import JointSample, drive, read_states, track
from bioscara.drivers.joint.cyclic import Outcome
from bioscara.errors import BioscaraError
from bioscara.hardware.axis import HALTED, Axis
from bioscara.hardware.command_modes import Mode


class Exchange:
    """Questions and commands to joints of one bus, each for several joints in one bus call.

    A joint that cannot go on is halted and told of; the others are not disturbed.

    Args:
        clock: Time of the bus.
        problems: Where it is told what befell a joint.

    Attributes:
        engaged: Whether the joints are meant to be engaged: one that is not has a problem.
    """

    def __init__(self, clock: Clock, problems: list[BioscaraError]) -> None:
        self._clock, self._problems = clock, problems
        self.engaged = False

    def ask(self, axes: Sequence[Axis]) -> None:
        """Ask joints where they are."""
        start = self._clock.now()
        outcomes = read_states([axis.joint for axis in axes], retry=True)
        self._take(axes, outcomes, start)

    def follow(self, axes: Sequence[Axis], time: float, period: float) -> None:
        """Give joints their positions; they answer with where they are.

        Args:
            axes: The joints.
            time: Begin of the cycle [s].
            period: Time from cycle to cycle [s].
        """
        start = self._clock.now()
        outcomes = track(
            [axis.joint for axis in axes], [axis.setpoint(period) for axis in axes], retry=True
        )
        self._take(axes, outcomes, start, time)

    def drive(self, axes: Sequence[Axis]) -> None:
        """Give joints their velocities; they answer with their flags alone."""
        velocities = [axis.velocity_command.value for axis in axes]
        outcomes = drive([axis.joint for axis in axes], velocities, retry=True)
        for axis, outcome in zip(axes, outcomes, strict=True):
            if isinstance(outcome, BioscaraError):
                axis.miss(outcome)
                self._halt(axis, outcome)
            else:
                self._notice(axis, outcome)

    def _take(
        self,
        axes: Sequence[Axis],
        outcomes: Sequence[Outcome],
        start: float,
        commanded: float | None = None,
    ) -> None:
        """Take what joints say; ``commanded`` is the begin of the cycle that commanded them."""
        # One bus call carries all frames, one after the other and all of the same length.
        share = (self._clock.now() - start) / len(axes)
        stamp = start
        for axis, outcome in zip(axes, outcomes, strict=True):
            stamp += share
            if isinstance(outcome, BioscaraError):
                axis.miss(outcome)
                self._halt(axis, outcome)
                continue
            axis.take(outcome, stamp)
            axis.answered = commanded is not None
            if commanded is not None:
                axis.arrival = stamp - commanded
            self._notice(axis, outcome)

    def _notice(self, axis: Axis, sample: JointSample) -> None:
        """Take a joint out that does not follow; one that is to home is engaged by that."""
        if not sample.flags & HALTED or axis.halted is not None or axis.mode is Mode.HOME:
            return
        if self.engaged:
            self._halt(axis, axis.why_halted())

    def _halt(self, axis: Axis, reason: BioscaraError) -> None:
        if axis.halt(reason):
            self._problems.append(reason)
