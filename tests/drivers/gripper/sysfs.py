"""A folder that behaves as the kernel's /sys/class/pwm."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest


class Kernel:
    """The kernel's side, and the clock that lets it act.

    ``Path.write_text`` is where values reach the kernel: it is replaced for paths below the root,
    so that each write is judged when it happens, as in the kernel.
    """

    LATE = 0.1

    def __init__(self, root: Path, patch: pytest.MonkeyPatch) -> None:
        self.root = root
        self.time = 0.0
        self.writes: list[tuple[str, int]] = []
        self.refuse: dict[str, OSError] = {}
        self._due: list[tuple[float, Path]] = []
        original = Path.write_text

        def write_text(path: Path, data: str, *args: object) -> int:
            if root not in path.parents:
                return original(path, data, *args)  # type: ignore[arg-type]
            self._write(path, int(data))
            return original(path, data)

        patch.setattr(Path, "write_text", write_text)
        self._put = original
        self.granted: dict[str, float] = {}
        """By the name of a file: how long after the folder udev grants its rights [s]."""
        self._made = 0.0
        access = os.access
        patch.setattr(
            os,
            "access",
            lambda path, mode: (
                access(path, mode)
                and (root not in Path(path).parents or self._may_write(Path(path).name))
            ),
        )

    def _may_write(self, name: str) -> bool:
        return self.time >= self._made + self.granted.get(name, 0.0)

    def now(self) -> float:
        return self.time

    def sleep_until(self, deadline: float) -> None:
        self.time = max(self.time, deadline)
        for due, folder in list(self._due):
            if due <= self.time:
                self._due.remove((due, folder))
                self.make_channel(folder)
                self._made = self.time

    def add_chip(self, number: int, device: str, channels: int = 4) -> Path:
        chip = self.root / f"pwmchip{number}"
        target = self.root.parent / "devices" / device
        target.mkdir(parents=True, exist_ok=True)
        chip.mkdir(parents=True)
        (chip / "device").symlink_to(f"../../devices/{device}")
        self._put(chip / "npwm", str(channels))
        self._put(chip / "export", "")
        return chip

    def make_channel(self, folder: Path, **values: int) -> None:
        folder.mkdir()
        for name in ("period", "duty_cycle", "enable"):
            self._put(folder / name, f"{values.get(name, 0)}\n")

    def value(self, folder: Path, name: str) -> int:
        return int((folder / name).read_text())

    def _write(self, path: Path, value: int) -> None:
        self.writes.append((path.name, value))
        if path.name in self.refuse:
            raise self.refuse[path.name]
        if not self._may_write(path.name):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
        if path.name == "export":
            self._export(path.parent, value)
            return
        period, duty = self.value(path.parent, "period"), self.value(path.parent, "duty_cycle")
        wrong = {
            "period": value <= 0 or value < duty,
            "duty_cycle": value < 0 or value > period,
            "enable": value not in (0, 1) or (value == 1 and period == 0),
        }[path.name]
        if wrong:
            raise OSError(22, "Invalid argument", str(path))

    def _export(self, chip: Path, channel: int) -> None:
        if channel >= self.value(chip, "npwm"):
            raise OSError(19, "No such device", str(chip))
        folder = chip / f"pwm{channel}"
        if folder.exists() or any(waiting == folder for _, waiting in self._due):
            raise OSError(16, "Device or resource busy", str(chip))
        self._due.append((self.time + self.LATE, folder))
