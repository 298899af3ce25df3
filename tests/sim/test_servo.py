"""The folder of a simulated servo is removed with the end of its process."""

from __future__ import annotations

import gc
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest

from bioscara.model import load_parameters
from bioscara.sim import SimulatedServo
from programs import LIMIT, environment, wait_for_line

OUTPUT = load_parameters().gripper.outputs[0]
SERVO = """
from bioscara.model import load_parameters
from bioscara.sim import SimulatedServo

servo = SimulatedServo(load_parameters().gripper.outputs[0])
print(servo.root, flush=True)
input()
"""
MANY = """
from bioscara.files.locked_folder import LockedFolder

for _ in range(2000):
    folder = LockedFolder("bioscara-servo-")
    (folder.path / "width").touch()
    folder.remove()
"""
Start = Callable[..., subprocess.Popen[str]]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder for temporary files, of this process and of those that it starts."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def servo_of_another(start: Start) -> tuple[subprocess.Popen[str], Path]:
    program = start("-c", SERVO, env=environment(), stdin=subprocess.PIPE)
    return program, Path(wait_for_line(program, "/").strip())


def test_the_folder_ends_with_the_servo(folder: Path) -> None:
    with SimulatedServo(OUTPUT) as servo:
        assert list(folder.iterdir()) == [servo.root]
    assert list(folder.iterdir()) == []
    servo.close()
    servo = SimulatedServo(OUTPUT)
    del servo
    gc.collect()
    assert list(folder.iterdir()) == []


def test_the_folder_of_a_killed_program_is_removed_at_the_next_start(
    start: Start, folder: Path
) -> None:
    killed, left = servo_of_another(start)
    _, used = servo_of_another(start)
    killed.kill()
    killed.wait(LIMIT)
    assert set(folder.iterdir()) == {left, used}
    (folder / "bioscara-servo-link").symlink_to(used)
    # An owner is such a program, too.
    served = start("-m", "bioscara", "serve", "--name", "killed", cold=True, env=environment())
    wait_for_line(served, "is served")
    assert not left.exists()
    assert (used / "pwmchip0/device").is_dir()
    served.kill()
    served.wait(LIMIT)
    with SimulatedServo(OUTPUT) as servo:
        (link,) = (each for each in folder.iterdir() if each.is_symlink())
        assert set(folder.iterdir()) == {used, servo.root, link}


def test_programs_that_start_at_once_leave_one_another_their_folders(
    start: Start, folder: Path
) -> None:
    programs = [start("-c", MANY, env=environment(), stderr=subprocess.PIPE) for _ in range(4)]
    said = [program.communicate(timeout=60.0)[1] for program in programs]
    assert [program.returncode for program in programs] == [0] * 4, said
    assert list(folder.iterdir()) == []
