"""A PWM output of the computer, through the kernel's /sys/class/pwm."""

from __future__ import annotations

import errno
import os
from collections.abc import Sequence
from pathlib import Path

from bioscara.arguments import number
from bioscara.clock import Clock
from bioscara.errors import GripperError, LimitError
from bioscara.model import PwmOutput

SYSFS = Path("/sys/class/pwm")

_REMEDY = "add dtoverlay=pwm-2chan to /boot/firmware/config.txt and reboot"
_RIGHTS = "run as a user who may write there (a udev rule for the group gpio)"
_IN_USE = "something else in this computer uses it: end that program or remove its overlay"
_REMEDIES = {
    errno.EACCES: _RIGHTS,
    errno.EPERM: _RIGHTS,
    errno.EBUSY: _IN_USE,
    errno.ENOENT: "the channel was taken away: enable() the gripper again",
}
_WRITTEN = ("period", "duty_cycle", "enable")
"""Files of a channel that are written."""
_APPEARS_WITHIN = 2.0
"""Timeout of the channel's folder and permissions [s]; they appear some 100 ms after the export."""
_POLL = 0.01
_NS = 1e9
_LONGEST = 4.0
"""Longest time that is written to the kernel [s]: it stores nanoseconds in 32 bits."""


class Pwm:
    """One PWM channel.

    The chip is found by the device behind it, since its number differs between kernels. Nothing
    is written before :meth:`start`.

    Args:
        outputs: Candidate outputs; the first one that exists is used.
        clock: Clock for waiting.
        root: The kernel's folder.
    """

    def __init__(
        self, outputs: Sequence[PwmOutput], clock: Clock, root: Path | str = SYSFS
    ) -> None:
        self._outputs, self._clock, self._root = tuple(outputs), clock, Path(root)
        self._channel: Path | None = None

    def pulse(self) -> float | None:
        """Return the length of the pulses being put out [s]; None while there are none.

        Raises:
            GripperError: There is no such output, or it cannot be read.
        """
        chip, channel = self._find()
        folder = chip / f"pwm{channel}"
        if not folder.is_dir() or self._read(folder / "enable") == 0:
            return None
        return self._read(folder / "duty_cycle") / _NS

    def start(self, period: float, pulse: float) -> None:
        """Put out pulses; an output that is running changes without a gap.

        Args:
            period: Time from pulse to pulse [s].
            pulse: Length of a pulse [s], below the period.

        Raises:
            GripperError: There is no such output, or the kernel refuses; names path and remedy.
            InvalidArgumentError: A time is no number of seconds that the kernel accepts.
        """
        period_ns, pulse_ns = _ns("PWM period", period), _ns("PWM pulse", pulse)
        folder = self._export()
        # The kernel refuses a period below the pulse, a pulse above the period, and to enable
        # without a period.
        if self._read(folder / "duty_cycle") > period_ns:
            self._write(folder / "duty_cycle", pulse_ns)
        if self._read(folder / "period") != period_ns:
            self._write(folder / "period", period_ns)
        self._write(folder / "duty_cycle", pulse_ns)
        if self._read(folder / "enable") != 1:
            self._write(folder / "enable", 1)
        self._channel = folder

    def set_pulse(self, pulse: float) -> None:
        """Change the length of the pulses [s].

        Raises:
            GripperError: The output was not started, or the kernel refuses.
        """
        if self._channel is None:
            raise GripperError("the PWM output is not running; start() it first")
        self._write(self._channel / "duty_cycle", _ns("PWM pulse", pulse))

    def stop(self) -> None:
        """Stop the pulses, which releases the servo.

        Raises:
            GripperError: The kernel refuses.
        """
        if self._channel is not None:
            channel, self._channel = self._channel, None
            self._write(channel / "enable", 0)

    def _find(self) -> tuple[Path, int]:
        devices: dict[str, Path] = {}
        for chip in sorted(self._root.glob("pwmchip*")):
            try:
                devices.setdefault(os.path.basename(os.readlink(chip / "device")), chip)
            except OSError:
                continue
        for output in self._outputs:
            if output.device in devices:
                return devices[output.device], output.channel
        wanted = ", ".join(output.device for output in self._outputs)
        found = ", ".join(devices) or "none"
        raise GripperError(
            f"{self._root}: no PWM chip of the devices {wanted} (found: {found}); {_REMEDY}"
        )

    def _export(self) -> Path:
        chip, channel = self._find()
        folder = chip / f"pwm{channel}"
        absent = _REMEDY
        if not folder.is_dir():
            try:
                (chip / "export").write_text(str(channel))
            except OSError as error:
                if error.errno == errno.ENODEV:
                    raise GripperError(f"{chip} has no channel {channel}; {_REMEDY}") from error
                if error.errno != errno.EBUSY:
                    raise _refused(chip / "export", channel, error) from error
                # Another process requested it just now and may grant access to it.
                absent = _IN_USE
        deadline = self._clock.now() + _APPEARS_WITHIN
        # udev grants the rights of one file after the other.
        while closed := [name for name in _WRITTEN if not os.access(folder / name, os.W_OK)]:
            now = self._clock.now()
            if now >= deadline:
                late = f"within {_APPEARS_WITHIN:g} s"
                if folder.is_dir():
                    path = folder / closed[0]
                    raise GripperError(f"{path} cannot be written {late}; {_RIGHTS}")
                raise GripperError(f"{folder} did not appear {late}; {absent}")
            self._clock.sleep_until(now + _POLL)
        return folder

    def _read(self, path: Path) -> int:
        try:
            return int(path.read_text())
        except (OSError, ValueError) as error:
            raise GripperError(f"{path}: cannot be read ({error}); {_REMEDY}") from error

    def _write(self, path: Path, value: int) -> None:
        try:
            path.write_text(str(value))
        except OSError as error:
            raise _refused(path, value, error) from error


def _ns(what: str, time: float) -> int:
    """Return a time [s] in ns; the kernel takes less than 2**32."""
    seconds = number(what, time)
    if not 0.0 <= seconds <= _LONGEST:
        raise LimitError(what, seconds, 0.0, _LONGEST, "s")
    return round(seconds * _NS)


def _refused(path: Path, value: int, error: OSError) -> GripperError:
    remedy = _REMEDIES.get(error.errno or 0, "see the kernel's log (dmesg)")
    return GripperError(f"{path}: writing {value} failed ({error.strerror}); {remedy}")
