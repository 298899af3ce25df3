"""Hostile clients of the owner's own socket: the arm moves, a STOP arrives, and nothing grows."""

from __future__ import annotations

import re
import resource
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from bioscara.api import messages as m
from bioscara.api.runtime import folder
from entries import entry
from hostile.moving_arm import LATENCY, NAME, PYTHON, MovingArm, moving_arm
from programs import LIMIT, environment, started, wait_for_line, wait_until
from served import RawClient

_FLOOD = Path(__file__).with_name("owner_flood.py")
_FILES = 1024


@contextmanager
def flooded(kind: str, count: int) -> Iterator[None]:
    """Let hostile clients flood the owner for a block of code."""
    words = [*PYTHON, str(_FLOOD), NAME, kind, str(count)]
    with started(words, stdout=subprocess.PIPE, env=environment()) as flood:
        wait_for_line(flood, "flooding")
        yield


def stop(arm: MovingArm) -> None:
    with RawClient("stopper", path=arm.socket) as client:
        client.request(m.StopAll())


def command_stop(_: MovingArm) -> None:
    command = [*PYTHON, "-m", "bioscara", "stop", "--arm", NAME]
    done = subprocess.run(command, env=environment(), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_floods_of_viewers_delay_no_stop(tmp_path: Path) -> None:
    with moving_arm(tmp_path, web=False) as arm, entry("questions"), flooded("questions", 8):
        assert arm.stop(lambda: stop(arm)) < LATENCY
        arm.until_moving()
        # With the begin of a Python program.
        assert arm.stop(lambda: command_stop(arm)) < 3.0 + LATENCY


@pytest.mark.thorough
def test_crowds_of_clients_delay_no_stop(tmp_path: Path) -> None:
    def few_files() -> None:
        resource.setrlimit(resource.RLIMIT_NOFILE, (_FILES, _FILES))

    with moving_arm(tmp_path, web=False, preexec_fn=few_files) as arm:
        for kind, count in (("hellos", 8), ("silent", 400), ("silent", 1400)):
            with entry(f"{kind} {count}"), flooded(kind, count):
                assert arm.stop(lambda: stop(arm)) < LATENCY
        with RawClient("counting", path=arm.socket) as client:
            assert client.welcome.last_event < 2000


@pytest.mark.thorough
def test_pauses_of_many_clients_only_pause(tmp_path: Path) -> None:
    with moving_arm(tmp_path, web=False) as arm:
        with flooded("pauses", 4), RawClient("looking", path=arm.socket) as client:
            wait_until(lambda: client.request(m.GetState()).paused, "the arm is paused", LIMIT)
            names = client.request(m.GetState()).paused_by
            assert len(names) <= 32
        stop(arm)
        arm.until_moving()


def test_nothing_is_left_of_an_owner_that_was_killed(tmp_path: Path) -> None:
    words = [*PYTHON, "-m", "bioscara", "serve", "--name", "killed", "--homed"]
    with started(words, stdout=subprocess.PIPE, env=environment(), cwd=tmp_path) as owner:
        wait_for_line(owner, "is served")
        family = descendants(owner.pid)
        assert len(family) >= 3, family
        owner.send_signal(signal.SIGKILL)
        owner.wait()
        wait_until(
            lambda: not [each for each in family if Path(f"/proc/{each}").exists()],
            f"processes {family} have ended",
            LIMIT,
        )


def descendants(process: int) -> list[int]:
    """Return the processes that a process has begun, and those of them."""
    children = Path(f"/proc/{process}/task/{process}/children").read_text().split()
    return [each for child in map(int, children) for each in (child, *descendants(child))]


def test_a_folder_that_a_group_may_write_is_for_a_group_alone(tmp_path: Path) -> None:
    folder().mkdir(mode=0o700, exist_ok=True)
    (place := tmp_path / "run").mkdir()
    place.chmod(0o770)
    given = {**environment(), "BIOSCARA_RUNTIME": str(place)}
    words = [*PYTHON, "-m", "bioscara", "serve", "--name", "shared"]
    done = subprocess.run(words, env=given, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert re.search(r"group.*may write|chmod g-w", done.stderr), done.stderr
