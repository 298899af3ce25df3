"""What is asked of systemd and udev: the commands that complete an installation, and the state."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from bioscara.errors import ConfigurationError
from bioscara.service.files import USERS, unit

_BOOTED = Path("/run/systemd/system")
"""Exists where systemd runs the computer, sd_booted(3)."""
_LOG_LINES = 10
Command = tuple[str, ...]


def after_install(name: str) -> list[Command]:
    """Return the commands after the files are written; the last one starts the service."""
    return [
        ("systemd-sysusers", str(USERS)),
        ("udevadm", "control", "--reload"),
        (
            "udevadm",
            "trigger",
            *(f"--subsystem-match={each}" for each in ("i2c-dev", "pwm", "usb")),
        ),
        ("systemctl", "daemon-reload"),
        ("systemctl", "enable", "--now", unit(name)),
    ]


def in_image(root: Path, name: str) -> list[Command]:
    """Return the commands that complete an installation in the file system of another computer."""
    return [
        ("systemd-sysusers", f"--root={root}"),
        ("systemctl", f"--root={root}", "enable", unit(name)),
    ]


def before_uninstall(name: str) -> Command:
    """Return the command before files are removed: the arm comes to rest and is released."""
    return ("systemctl", "disable", "--now", unit(name))


def after_uninstall() -> list[Command]:
    """Return the commands after files were removed."""
    return [("systemctl", "daemon-reload"), ("udevadm", "control", "--reload")]


def check_commands(commands: Sequence[Command]) -> None:
    """Raise unless the commands can be run.

    Raises:
        ConfigurationError: systemd does not run this computer, or a program is missing.
    """
    if not _BOOTED.is_dir():
        raise ConfigurationError(
            f"systemd does not run this computer: there is no {_BOOTED}; --root DIR writes the "
            "files alone, or run bioscara serve by other means"
        )
    for program, *_ in commands:
        if shutil.which(program) is None:
            raise ConfigurationError(f"there is no program {program}, which comes with systemd")


def problem_of(command: Command) -> str:
    """Run a command; return what it says if it fails, and an empty text otherwise."""
    ended = _ended(command)
    if ended.returncode == 0:
        return ""
    said = (ended.stderr or ended.stdout).strip().splitlines()
    return said[0] if said else f"status {ended.returncode}"


def properties(name: str) -> dict[str, str]:
    """Return what systemd knows about the unit of an arm."""
    wanted = "ActiveState,SubState,StateChangeTimestamp,UnitFileState,Result,NRestarts,MainPID"
    said = _ended(("systemctl", "show", unit(name), f"--property={wanted}")).stdout
    return dict(line.split("=", 1) for line in said.splitlines() if "=" in line)


def log_lines(name: str) -> list[str]:
    """Return the last lines of the journal about the unit of an arm that this user may read."""
    words = ("--no-pager", "--quiet", "--output=short-iso", f"--lines={_LOG_LINES}")
    return _ended(("journalctl", f"--unit={unit(name)}", *words)).stdout.splitlines()


def _ended(command: Command) -> subprocess.CompletedProcess[str]:
    # Programs of systemd, and the name of an arm.
    return subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603
