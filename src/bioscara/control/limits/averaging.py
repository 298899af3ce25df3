"""Averages raw commands over the periods of the belts, so that the belts do not swing.

Planned motions and jogs are already smooth. Any other command is bounded joint by joint and kept
clear first; its average over the periods of the belts is sent to the joints. The average lags by
half of these periods, all joints alike. Averaging begins at rest: begun in motion, the average
would carry the arm on for that time before it brakes.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from bioscara.control.limits.joint_limiter import JointLimiter
from bioscara.control.limits.limiter import CommandSource, Property
from bioscara.planning.arrays import Array
from bioscara.planning.moving_average import Smoothed

_STRIDE = 3
"""One of so many cycles of a stop is checked."""


class Smoothing:
    """The last stage of the limiter; its :meth:`prepare` is called first.

    Between cycles a joint's limiter holds the sent command; while commands are bounded, it holds
    the one that would be sent without this stage.

    Args:
        joints: All joints of the arm.
        rate: Cycles per second [Hz].

    Attributes:
        windows: Lengths of the averages, applied one after the other [s]; may be changed at rest.
        awaits_rest: Whether raw commands have taken over a moving arm, which has to come to rest
            first.
        sent: Where the joints were sent to in the cycle before [rad or m].
    """

    CONCERNS: ClassVar[Property] = "smooth"

    def __init__(self, joints: Sequence[JointLimiter], rate: int) -> None:
        self._joints, self._rate = tuple(joints), rate
        self.windows: tuple[float, ...] = ()
        self.awaits_rest = False
        self._average: Smoothed | None = None
        self.sent: list[float] = []
        self._still = 0.0  # Time for which the bounded commands have been at rest [s].

    def prepare(self, period: float, raw: Sequence[CommandSource]) -> None:
        """Continue from the last bounded command, not from the sent one.

        Args:
            period: Time since the last cycle [s].
            raw: Sources whose commands are averaged.
        """
        self.awaits_rest = False
        if not raw or not self.windows:
            if self._average is not None:
                self._average = None
                for joint in self._joints:
                    joint.continue_from_sent()
            return
        if self._average is None:
            self.awaits_rest = any(joint.state[1] for joint in self._joints)
            if not self.awaits_rest:
                self._begin()
            return
        settled = self._still > sum(self.windows) + period
        for joint in self._joints:
            joint.continue_from_bounded()
            if settled:
                joint.approach_lag()
        self._record()

    def apply(self, period: float, raw: Sequence[CommandSource]) -> None:
        """Send the average; to be called after all bounds; arguments as :meth:`prepare`."""
        if self._average is None:
            return
        one, two, three, four = self._joints
        bounded = one.state[1], two.state[1], three.state[1], four.state[1]
        self._still = 0.0 if any(bounded) else self._still + period
        a, b, c, d = self._average.step(bounded, period)
        at, bt, ct, dt = self.sent
        one.send(a, at, period)
        two.send(b, bt, period)
        three.send(c, ct, period)
        four.send(d, dt, period)

    def stopping_path(
        self, speeds: Sequence[float], duration: float, period: float, rest: Sequence[float]
    ) -> Array:
        """Return the setpoints sent from now on if all joints brake together.

        Args:
            speeds: From which they brake, after this cycle [rad/s or m/s].
            duration: Until they stand, without averaging [s].
            period: Time from cycle to cycle [s].
            rest: Where they come to rest [rad or m].

        Returns:
            The joints from where they were sent to before this cycle on, shape (n, joints).

        Raises:
            RuntimeError: Nothing is averaged now.
        """
        if self._average is None:
            raise RuntimeError("nothing is averaged")
        count = math.ceil((duration + sum(self.windows)) / period) + 2
        left = np.clip(1.0 - np.arange(count) * (period / max(duration, period)), 0.0, 1.0)
        sent = self._average.ahead(left[:, None] * speeds, period)
        # An average bends so little that between its thirds it is straight to 0.2 mm.
        path = self.sent + sent.cumsum(axis=0) * period
        return np.vstack((self.sent, path[_STRIDE - 1 :: _STRIDE], rest))

    def recent_bounds(self) -> list[list[float]]:
        """Return the bounds of the recently sent and requested joint positions [rad or m]."""
        columns = list(zip(*self._recent, strict=True))
        return [[min(column) for column in columns], [max(column) for column in columns]]

    @property
    def active(self) -> bool:
        """Whether the sent commands are averages."""
        return self._average is not None

    def _begin(self) -> None:
        """Begin averaging, assuming that the joints have long been at rest."""
        self._average, self._still = Smoothed(self.windows, (0.0,) * len(self._joints)), 0.0
        count = math.ceil(sum(self.windows) * self._rate) + 2
        self._recent: deque[list[float]] = deque(maxlen=2 * count)
        self._record()

    def _record(self) -> None:
        """Remember the sent and the requested joint positions."""
        self.sent = [joint.sent for joint in self._joints]
        self._recent += self.sent, [joint.here for joint in self._joints]
