"""A PID controller of one joint, with the semantics of control_toolbox."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Literal

from bioscara.model.validation import Checked, Finite, NotNegative, Problem, Within

Unbounded = Annotated[float, Within(-math.inf, math.inf)]
AntiWindup = Literal["none", "conditional_integration", "back_calculation"]


class Gains(Checked):
    """Gains of one joint; names and defaults as in ros2_controllers.

    Attributes:
        p: Proportional gain [1/s for a velocity command].
        i: Integral gain.
        d: Derivative gain.
        ff_velocity_scale: Share of the desired velocity that is fed forward.
        u_clamp_max: Highest output.
        u_clamp_min: Lowest output.
        i_clamp_max: Highest integral term.
        i_clamp_min: Lowest integral term.
        antiwindup_strategy: Handling of the integral while the output is clamped.
        tracking_time_constant: Of back calculation [s]; 0 chooses one from the gains.
        error_deadband: Error within which nothing is integrated.
    """

    p: Finite = 0.0
    i: Finite = 0.0
    d: Finite = 0.0
    ff_velocity_scale: Finite = 0.0
    u_clamp_max: Unbounded = math.inf
    u_clamp_min: Unbounded = -math.inf
    i_clamp_max: Unbounded = math.inf
    i_clamp_min: Unbounded = -math.inf
    antiwindup_strategy: AntiWindup = "none"
    tracking_time_constant: NotNegative = 0.0
    error_deadband: NotNegative = 0.0

    def problems(self) -> Iterator[Problem]:
        """Yield clamps whose lower end is above the upper one."""
        for what, low, high in (
            ("u_clamp", self.u_clamp_min, self.u_clamp_max),
            ("i_clamp", self.i_clamp_min, self.i_clamp_max),
        ):
            if not low <= high:
                yield Problem(f"{what}_min {low:g} must not be above {what}_max {high:g}")


class Pid:
    """The integral of one joint and the resulting output.

    The output uses the integral of the cycle before: ``u = p e + I + d e'``, bounded, and only
    then the integral is advanced.

    Args:
        gains: Its gains; may be replaced at any time.

    Attributes:
        gains: As given.
    """

    __slots__ = ("_integral", "_last", "gains")

    def __init__(self, gains: Gains) -> None:
        self.gains = gains
        self.reset()

    def reset(self) -> None:
        """Reset the integral and the last command."""
        self._integral = self._last = 0.0

    def update(self, error: float, error_rate: float, period: float) -> float:
        """Return the command.

        Args:
            error: Desired minus measured.
            error_rate: Its derivative.
            period: Time since the last update [s]; 0 repeats the last command.

        Returns:
            The command; NaN for an error that is not finite.
        """
        if period <= 0.0:
            return self._last
        if not (math.isfinite(error) and math.isfinite(error_rate)):
            return math.nan
        gains = self.gains
        wanted = gains.p * error + self._integral + gains.d * error_rate
        command = min(max(wanted, gains.u_clamp_min), gains.u_clamp_max)
        if abs(error) > gains.error_deadband:
            self._integrate(error, wanted, command, period)
        self._last = command
        return command

    def _integrate(self, error: float, wanted: float, command: float, period: float) -> None:
        gains = self.gains
        integral = self._integral
        if gains.antiwindup_strategy == "back_calculation":
            integral += period * (gains.i * error + (command - wanted) / self._tracking_time())
        elif (
            gains.antiwindup_strategy == "none"
            or wanted == command
            or (wanted - command) * error < 0.0
        ):
            integral += period * gains.i * error
        self._integral = min(max(integral, gains.i_clamp_min), gains.i_clamp_max)

    def _tracking_time(self) -> float:
        gains = self.gains
        if gains.tracking_time_constant > 0.0:
            return gains.tracking_time_constant
        if gains.d > 0.0 and gains.i > 0.0:
            return math.sqrt(gains.d / gains.i)
        return gains.p / gains.i if gains.i > 0.0 and gains.p > 0.0 else 1.0
