"""Simulated gripper servo: a folder with the layout of the kernel's /sys/class/pwm."""

from __future__ import annotations

import shutil
import weakref
from pathlib import Path
from tempfile import mkdtemp

from bioscara.model import PwmOutput

_NS = 1e9


class SimulatedServo:
    """One PWM chip with one exported channel.

    Its folder is temporary: until :meth:`close`, until the object is no longer referenced, or until
    the process ends, except by a signal that it does not handle.

    Values that the kernel would refuse are not refused here.

    Args:
        output: The output to which it is wired.

    Attributes:
        root: Folder in place of ``/sys/class/pwm``.
    """

    def __init__(self, output: PwmOutput) -> None:
        self.root = Path(mkdtemp(prefix="bioscara-pwm-"))
        self._remove = weakref.finalize(self, shutil.rmtree, self.root, ignore_errors=True)
        chip = self.root / "pwmchip0"
        self._channel = chip / f"pwm{output.channel}"
        self._channel.mkdir(parents=True)
        device = self.root / "devices" / output.device
        device.mkdir(parents=True)
        (chip / "device").symlink_to(device)
        for name in ("period", "duty_cycle", "enable"):
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

    def close(self) -> None:
        """Remove the folder; safe to call twice."""
        self._remove()
