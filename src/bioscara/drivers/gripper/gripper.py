"""Parallel gripper driven by a servo without feedback."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass, replace
from pathlib import Path

from bioscara.arguments import number, numbers
from bioscara.drivers.gripper.pwm import Pwm
from bioscara.drivers.gripper.width_store import read_width, write_width
from bioscara.errors import GripperError, InvalidArgumentError, LimitError
from bioscara.model import GripperParameters

_MILLIMETRES = 1.0
"""Widths from here up can only be meant in millimetres, the unit of the original driver [m]."""


@dataclass(frozen=True, slots=True)
class GripperState:
    """State of the gripper.

    Attributes:
        width: Commanded width between the jaws [m].
        enabled: Whether the servo is driven.
        assumed: True: the servo has no sensor, so the actual width is unknown.
    """

    width: float
    enabled: bool
    assumed: bool = True


class Gripper:
    """The gripper on one PWM output.

    The width outlives the process: the kernel keeps the last pulse running after a ``kill -9``, and
    :meth:`enable` continues from that. The state file covers a loss of power and a released servo.
    Only :meth:`store_width`, :meth:`set_width` and :meth:`disable` write it and wait for the disk.

    Args:
        pwm: The PWM output.
        parameters: Parameters of the gripper.
        state_file: File of the last width, so that enabling does not move the jaws.
    """

    def __init__(self, pwm: Pwm, parameters: GripperParameters, state_file: Path | str) -> None:
        self.parameters = parameters
        self._pwm, self._file = pwm, Path(state_file)
        self._enabled = False
        # A width may be stored in a thread of its own, as the cycles do not wait for the disk.
        self._saving = threading.Lock()
        self._width = self._saved = self._stored_width()

    @property
    def state(self) -> GripperState:
        """State of the gripper."""
        return GripperState(self._width, self._enabled)

    def check(self) -> None:
        """Check that there is an output for the servo; nothing is written.

        Raises:
            GripperError: There is none; names path and remedy.
        """
        self._pwm.pulse()

    def enable(self) -> None:
        """Drive the servo at its present position: the running pulse, else the last width.

        The last width is the one in the state file, unless this object has commanded another one
        since.

        Raises:
            GripperError: The output cannot be used; names path and remedy.
        """
        running = self._pwm.pulse()
        if running is not None:
            # Another program may have left a pulse beyond the limits.
            width = self.parameters.width_at(running)
            self._width = min(max(width, self.parameters.lower), self.parameters.upper)
        elif self._width == self._saved:
            self._width = self._saved = self._stored_width()
        self._pwm.start(1.0 / self.parameters.frequency, self._pulse_of(self._width))
        self._enabled = True

    def disable(self, *, store: bool = True) -> None:
        """Store the width and release the servo.

        Args:
            store: False releases the servo without a file access, as required in a control cycle.

        Raises:
            GripperError: The output or the state file cannot be written; the servo is released in
                any case that the kernel allows.
        """
        if not self._enabled:
            return
        self._enabled = False
        try:
            if store:
                self._save(self._width)
        finally:
            self._pwm.stop()

    def store_width(self, width: float | None = None) -> None:
        """Write a width to the state file, unless it is the one stored there last.

        Waits for the disk, on a memory card up to some 100 ms: never call it within a control
        cycle. Store a width before commanding it, and the last commanded width when the jaws were
        stopped before reaching the stored one: after a loss of power, the file is then off by the
        remaining travel of the jaws, and exact once they rest.

        Args:
            width: Width to be commanded [m], bounded to the limits; None for the width
                commanded last.

        Raises:
            InvalidArgumentError: Not finite.
            GripperError: The state file cannot be written; its content is unchanged.
        """
        commanded = self._width
        if width is not None:
            commanded = self.parameters.width_at(self._pulse_of(number("gripper width", width)))
        if commanded != self._saved:
            self._save(commanded)

    def set_width(self, width: float) -> float:
        """Store a width, move the jaws, and return the commanded width.

        A width beyond the limits is bounded, as the original driver does. It waits for the disk as
        :meth:`store_width` does, unless this width is already commanded.

        Args:
            width: Width between the jaws [m].

        Raises:
            LimitError: 1 m or more, which only a number of millimetres is.
            InvalidArgumentError: Not finite.
            GripperError: Not enabled, or the output or the state file cannot be written.
        """
        width = number("gripper width", width)
        if width >= _MILLIMETRES:
            lower, upper = self.parameters.lower, self.parameters.upper
            remedy = f"it is given in metres: {width:g} mm are {width / 1e3:g}"
            raise LimitError("gripper width", width, lower, upper, "m", remedy)
        self._require_enabled()
        self.store_width(width)
        return self.command_width(width)

    def command_width(self, width: float) -> float:
        """As :meth:`set_width`, without storing the width: for a control cycle.

        Its goals were checked before, so it bounds any finite width.

        Raises:
            InvalidArgumentError: Not finite.
            GripperError: Not enabled, or the output cannot be written.
        """
        width = number("gripper width", width)
        self._require_enabled()
        pulse = self._pulse_of(width)
        commanded = self.parameters.width_at(pulse)
        if commanded != self._width:
            self._pwm.set_pulse(pulse)
            self._width = commanded
        return commanded

    def set_servo_angle(self, angle_deg: float) -> float:
        """Turn the servo to an angle, for calibration, and return the commanded angle.

        Args:
            angle_deg: Servo angle, bounded to the range of the servo [deg].

        Raises:
            InvalidArgumentError: Not finite.
            GripperError: Not enabled, or the output cannot be written.
        """
        angle_deg = number("gripper servo angle", angle_deg)
        self._require_enabled()
        pulse = self._bounded_pulse(angle_deg)
        self._pwm.set_pulse(pulse)
        self._width = self.parameters.width_at(pulse)
        return (pulse - self.parameters.pulse_center) / self.parameters.pulse_per_deg

    def _save(self, width: float) -> None:
        lower, upper = self.parameters.lower, self.parameters.upper
        with self._saving:
            write_width(self._file, min(max(width, lower), upper))
            self._saved = width

    def _stored_width(self) -> float:
        parameters = self.parameters
        width = read_width(self._file, parameters.lower, parameters.upper, parameters.initial)
        return parameters.width_at(self._pulse_of(width))

    def _require_enabled(self) -> None:
        if not self._enabled:
            raise GripperError("the gripper is not enabled; enable() it first")

    def _pulse_of(self, width: float) -> float:
        parameters = self.parameters
        bounded = min(max(width, parameters.lower), parameters.upper)
        return self._bounded_pulse(parameters.angle_at(bounded))

    def _bounded_pulse(self, angle_deg: float) -> float:
        parameters = self.parameters
        pulse = parameters.pulse_center + angle_deg * parameters.pulse_per_deg
        return min(max(pulse, parameters.pulse_lower), parameters.pulse_upper)


def calibrate(
    parameters: GripperParameters, first: tuple[float, float], second: tuple[float, float]
) -> GripperParameters:
    """Return ``parameters`` with the line through two measured points.

    Limits that the servo does not reach on this line are moved to the end of its range.

    Args:
        parameters: Parameters of the gripper.
        first: Servo angle [deg] and the width measured there [m].
        second: Another such pair.

    Raises:
        InvalidArgumentError: The points are not finite, do not make a line with a slope, or the
            servo reaches no width within the limits on that line.
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
    smallest, largest = parameters.reach_on(slope, zero)
    lower, upper = max(parameters.lower, smallest), min(parameters.upper, largest)
    if lower >= upper:
        raise InvalidArgumentError(
            f"gripper calibration: on the line through {first} and {second} the servo reaches "
            f"{smallest:.4g} .. {largest:.4g} m, none of the widths {parameters.lower:g} .. "
            f"{parameters.upper:g} m; measure again"
        )
    return replace(
        parameters,
        deg_per_m=slope,
        zero_width=zero,
        lower=lower,
        upper=upper,
        initial=min(max(parameters.initial, lower), upper),
    )
