"""Simulated gripper servo: a folder with the layout of the kernel's /sys/class/pwm."""

from __future__ import annotations

import weakref

from bioscara.files.locked_folder import LockedFolder
from bioscara.model import PwmOutput

_NS = 1e9
_FILES = ("period", "duty_cycle", "enable")


class SimulatedServo:
    """One PWM chip with one exported channel.

    Its folder is temporary: until :meth:`close`, until the object is no longer referenced, or until
    the process ends. That of a process which was killed is removed when the next servo is made.

    Values that the kernel would refuse are not refused here.

    Args:
        output: The output to which it is wired.

    Attributes:
        root: Folder in place of ``/sys/class/pwm``.
    """

    def __init__(self, output: PwmOutput) -> None:
        folder = LockedFolder("bioscara-servo-")
        self.root = folder.path
        self._remove = weakref.finalize(self, folder.remove)
        chip = self.root / "pwmchip0"
        self._channel = chip / f"pwm{output.channel}"
        self._channel.mkdir(parents=True)
        device = self.root / "devices" / output.device
        device.mkdir(parents=True)
        (chip / "device").symlink_to(device)
        for name in _FILES:
            (self._channel / name).write_text("0\n")

    def __enter__(self) -> SimulatedServo:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def pulse(self) -> float | None:
        """Return the pulse that reaches the servo [s]; None while there is none."""
        if not int((self._channel / "enable").read_text()):
            return None
        return int((self._channel / "duty_cycle").read_text()) / _NS

    @property
    def output(self) -> tuple[str, ...]:
        """Values of the output: period, duty cycle and whether it is enabled."""
        return tuple((self._channel / name).read_text() for name in _FILES)

    @output.setter
    def output(self, written: tuple[str, ...]) -> None:
        for name, value in zip(_FILES, written, strict=True):
            (self._channel / name).write_text(value)

    def close(self) -> None:
        """Remove the folder; safe to call twice."""
        self._remove()
