"""The parallel gripper: a width goes to a servo that never answers."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

from bioscara.arguments import number, numbers
from bioscara.drivers.gripper.pwm import Pwm
from bioscara.drivers.gripper.width_store import read_width, write_width
from bioscara.errors import GripperError, InvalidArgumentError
from bioscara.model import GripperParameters


@dataclass(frozen=True, slots=True)
class GripperState:
    """What is known about the gripper.

    Attributes:
        width: Width between the jaws [m], as the servo was told.
        enabled: Whether the servo is driven.
        assumed: True: the servo has no sensor, so nobody knows whether the jaws are there.
    """

    width: float
    enabled: bool
    assumed: bool = True


class Gripper:
    """The gripper on one PWM output.

    The width outlives the process: the kernel goes on with the last pulse after a ``kill -9``, and
    :meth:`enable` goes on from that. The state file is for a loss of power, and for a servo that
    was let go. :meth:`keep`, :meth:`set_width` and :meth:`disable` write it and wait for the disk;
    nothing else does.

    Args:
        pwm: The output.
        parameters: What the gripper is.
        state_file: Where the last width is kept, so that enabling does not move the jaws.
    """

    def __init__(self, pwm: Pwm, parameters: GripperParameters, state_file: Path) -> None:
        self.parameters = parameters
        self._pwm, self._file = pwm, state_file
        self._enabled = False
        self._width = self._saved = self._kept()

    @property
    def state(self) -> GripperState:
        """What is known about the gripper."""
        return GripperState(self._width, self._enabled)

    def check(self) -> None:
        """Return if there is an output to drive the servo by; nothing is written.

        Raises:
            GripperError: There is none; names path and remedy.
        """
        self._pwm.pulse()

    def enable(self) -> None:
        """Drive the servo to where it is: to the pulse that runs, else to the last width.

        The last width is the one in the state file, unless this object told another one since.

        Raises:
            GripperError: The output cannot be used; names path and remedy.
        """
        running = self._pwm.pulse()
        if running is not None:
            self._width = self._width_of(running)
        elif self._width == self._saved:
            self._width = self._saved = self._kept()
        self._pwm.start(1.0 / self.parameters.frequency, self._pulse_of(self._width))
        self._enabled = True

    def disable(self, *, keep: bool = True) -> None:
        """Keep the width and let the servo go.

        Args:
            keep: False lets go without a file access, as a control cycle must.

        Raises:
            GripperError: The output or the state file cannot be written; the servo is let go
                in any case that the kernel allows.
        """
        if not self._enabled:
            return
        self._enabled = False
        try:
            if keep:
                self._save(self._width)
        finally:
            self._pwm.stop()

    def keep(self, width: float | None = None) -> None:
        """Put a width into the state file, if it is not the one kept there last.

        Takes as long as the disk does, on a memory card up to some 100 ms: never within a control
        cycle. Keep a width before the jaws are told it, and the one told last when they were
        stopped before it: then after a loss of power the file is off by what the jaws had still to
        go, and not at all once they rest.

        Args:
            width: What the jaws will be told [m], bounded as by :meth:`set_width`; None for the
                width told last.

        Raises:
            InvalidArgumentError: Not finite.
            GripperError: The state file cannot be written; it holds what it held before.
        """
        told = self._width
        if width is not None:
            told = self._width_of(self._pulse_of(number("gripper width", width)))
        if told != self._saved:
            self._save(told)

    def set_width(self, width: float) -> float:
        """Keep a width, move the jaws, and return the width that they are told.

        A width beyond the limits, or beyond what the servo can do, is bounded, as the original
        driver does. It waits for the disk as :meth:`keep` does; the width that is told already
        costs nothing.

        Args:
            width: Width between the jaws [m].

        Raises:
            InvalidArgumentError: Not finite.
            GripperError: Not enabled, or the output or the state file cannot be written.
        """
        width = number("gripper width", width)
        self._require_enabled()
        self.keep(width)
        return self.tell_width(width)

    def tell_width(self, width: float) -> float:
        """As :meth:`set_width`, without keeping the width: for a control cycle.

        Raises:
            InvalidArgumentError: Not finite.
            GripperError: Not enabled, or the output cannot be written.
        """
        width = number("gripper width", width)
        self._require_enabled()
        pulse = self._pulse_of(width)
        told = self._width_of(pulse)
        if told != self._width:
            self._pwm.set_pulse(pulse)
            self._width = told
        return told

    def set_servo_angle(self, angle_deg: float) -> float:
        """Turn the servo to an angle, for calibration, and return the angle that it is told.

        Args:
            angle_deg: Servo angle, bounded to what the servo can do [deg].

        Raises:
            InvalidArgumentError: Not finite.
            GripperError: Not enabled, or the output cannot be written.
        """
        angle_deg = number("gripper servo angle", angle_deg)
        self._require_enabled()
        pulse = self._bounded_pulse(angle_deg)
        self._pwm.set_pulse(pulse)
        self._width = self._width_of(pulse)
        return (pulse - self.parameters.pulse_center) / self.parameters.pulse_per_deg

    def _save(self, width: float) -> None:
        lower, upper = self.parameters.lower, self.parameters.upper
        write_width(self._file, min(max(width, lower), upper))
        self._saved = width

    def _kept(self) -> float:
        parameters = self.parameters
        width = read_width(self._file, parameters.lower, parameters.upper, parameters.initial)
        return self._width_of(self._pulse_of(width))

    def _require_enabled(self) -> None:
        if not self._enabled:
            raise GripperError("the gripper is not enabled; enable() it first")

    def _pulse_of(self, width: float) -> float:
        parameters = self.parameters
        bounded = min(max(width, parameters.lower), parameters.upper)
        return self._bounded_pulse(parameters.deg_per_m * (bounded - parameters.zero_width))

    def _bounded_pulse(self, angle_deg: float) -> float:
        parameters = self.parameters
        pulse = parameters.pulse_center + angle_deg * parameters.pulse_per_deg
        return min(max(pulse, parameters.pulse_lower), parameters.pulse_upper)

    def _width_of(self, pulse: float) -> float:
        parameters = self.parameters
        angle_deg = (pulse - parameters.pulse_center) / parameters.pulse_per_deg
        return parameters.zero_width + angle_deg / parameters.deg_per_m


def calibrate(
    parameters: GripperParameters, first: tuple[float, float], second: tuple[float, float]
) -> GripperParameters:
    """Return ``parameters`` with the line through two measured points.

    Args:
        parameters: What the gripper is.
        first: Servo angle [deg] and the width measured there [m].
        second: Another such pair.

    Raises:
        InvalidArgumentError: The points are not finite, or do not make a line with a slope.
    """
    if not isinstance(parameters, GripperParameters):
        raise InvalidArgumentError("gripper calibration: give the parameters of a gripper first")
    pairs = [numbers("gripper calibration: a point", point) for point in (first, second)]
    if any(len(pair) != 2 for pair in pairs):
        raise InvalidArgumentError("gripper calibration: a point is an angle [deg] and a width [m]")
    (first_deg, first_width), (second_deg, second_width) = pairs
    if first_deg == second_deg or first_width == second_width:
        raise InvalidArgumentError(
            f"gripper calibration: {first} and {second} must differ in angle and in width"
        )
    slope = (first_deg - second_deg) / (first_width - second_width)
    zero = (first_deg * second_width - second_deg * first_width) / (first_deg - second_deg)
    if slope == 0.0 or not math.isfinite(slope) or not math.isfinite(zero):
        raise InvalidArgumentError(f"gripper calibration: no line goes through {first}, {second}")
    return replace(parameters, deg_per_m=slope, zero_width=zero)
