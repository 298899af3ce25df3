"""An arm is served, stopped and recorded while the output of these programs is not read."""

from __future__ import annotations

import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import httpx
import pytest

from bioscara.api import messages as m
from bioscara.api.runtime import find
from bioscara.errors import BioscaraError
from bioscara.remote import RemoteRobot
from hostile.moving_arm import LATENCY, moving_arm
from programs import LIMIT, environment, wait_for_line, wait_until
from recording.served_arm import NAME as RECORDED, served
from served import NAME, RawClient, runtime_folder
from server.endings import PROGRAM
from unread import Unread, unread

Start = Callable[..., subprocess.Popen[str]]

IN_TIME = 1.5
"""Time in which the arm is at rest and the lease ends, also on a busy computer [s]."""
REPORTS = 300
"""Reports of clients, each a line of 2 KB in the log: more than the owner keeps."""
FLOOD = "\N{ROBOT FACE}" * 490


@pytest.fixture
def folder() -> Iterator[Path]:
    with runtime_folder() as made:
        yield made


@contextmanager
def outputs(kinds: dict[str, str]) -> Iterator[dict[str, Unread]]:
    """Make the unread outputs of a program, by ``stdout`` and ``stderr``."""
    with ExitStack() as stack:
        yield {name: stack.enter_context(unread(kind)) for name, kind in kinds.items()}


def is_served(name: str) -> bool:
    try:
        with RawClient(path=find(name).socket):
            return True
    except (OSError, BioscaraError):
        return False


def begin_motion(start: Start) -> subprocess.Popen[str]:
    """Start a program that moves the arm, and return once it moves."""
    process = start(str(PROGRAM), "outside of a with", "", env=environment())
    wait_for_line(process, "moving")
    return process


def speed(robot: RemoteRobot) -> float:
    """Return the speed of the fastest joint."""
    return max(map(abs, robot.state.velocities))


@pytest.mark.parametrize(
    "kinds",
    [
        {"stderr": "pipe"},
        *(
            pytest.param(kinds, marks=pytest.mark.thorough)
            for kinds in (
                {"stderr": "terminal"},
                {"stdout": "pipe"},
                {"stdout": "terminal", "stderr": "terminal"},
            )
        ),
    ],
    ids=lambda kinds: "-".join(f"{name}-{kind}" for name, kind in kinds.items()),
)
def test_an_owner_stops_and_ends_leases_while_its_output_is_not_read(
    start: Start, folder: Path, kinds: dict[str, str], tmp_path: Path
) -> None:
    assert folder.is_dir()
    words = ("-m", "bioscara", "serve", "--name", NAME, "--homed")
    with outputs(kinds) as unread_ones, ExitStack() as clients:
        files: dict[str, int] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        files |= {name: each.written for name, each in unread_ones.items()}
        owner = start(*words, env=environment(), cwd=tmp_path, **files)
        wait_until(lambda: is_served(NAME), "an owner")
        robot = clients.enter_context(RemoteRobot(NAME))
        for each in unread_ones.values():
            each.block()
        with RawClient("operator") as operator:
            for _ in range(REPORTS if "stderr" in kinds else 1):
                operator.request(m.Report(text=FLOOD))
        ways: list[Callable[[subprocess.Popen[str]], object]] = [
            lambda _: robot.stop(),
            lambda _: start("-m", "bioscara", "stop", NAME, env=environment()),
            lambda program: program.kill(),
        ]
        for stop in ways:
            program = begin_motion(start)
            begin = time.monotonic()
            stop(program)
            wait_until(lambda: speed(robot) < 1e-3, "the arm comes to rest")
            assert time.monotonic() - begin < IN_TIME
            program.kill()
            robot.acquire_lease(timeout=IN_TIME)
            robot.release_lease()
        if "stderr" in unread_ones:
            log = unread_ones["stderr"]
            log.read()
            log.wait_for(r"warning: lines left out here, as the output was not read: \d+\n")
        owner.terminate()
        assert owner.wait(LIMIT) == 0


@pytest.mark.parametrize("number", [signal.SIGABRT, signal.SIGSEGV])
@pytest.mark.parametrize("blocked", [False, True])
def test_an_aborted_owner_writes_its_stacks_and_ends(
    start: Start, folder: Path, number: signal.Signals, *, blocked: bool, tmp_path: Path
) -> None:
    assert folder.is_dir()
    with unread() as log:
        owner = start(
            *("-m", "bioscara", "serve", "--name", NAME, "--bus", "sim"),
            env=environment(),
            cwd=tmp_path,
            stdout=subprocess.DEVNULL,
            stderr=log.written,
        )
        wait_until(lambda: is_served(NAME), "an owner")
        if blocked:
            log.block()
        owner.send_signal(number)
        assert owner.wait(LIMIT) != 0
        log.read()
        if not blocked:
            text = log.wait_for("(?s)Fatal Python error.*\n\n")
            assert "serve.py" in text
            assert "most recent call first" in text


@pytest.mark.thorough
def test_a_gateway_stops_the_arm_while_its_output_is_not_read(tmp_path: Path) -> None:
    with unread() as log, moving_arm(tmp_path, stderr=log.written) as arm:
        log.block()
        with httpx.Client(base_url=arm.origin, timeout=LIMIT) as client:
            headers = {"Origin": arm.origin}
            answer = client.post("/session", json={"token": "x" * 20}, headers=headers)
            assert answer.status_code == 401
        assert arm.stop(arm.post_stop) < LATENCY
        log.read()
        log.wait_for("a sign-in from 127.0.0.1 was refused")


@pytest.mark.thorough
def test_a_recorder_records_while_its_output_is_not_read(start: Start, tmp_path: Path) -> None:
    words = ("record", "--arm", RECORDED, "--out", str(tmp_path), "--max-time", "0.2")
    with unread() as output, served(tmp_path):
        recorder = start("-m", "bioscara", *words, env=environment(), stdout=output.written)
        wait_until(lambda: len([*tmp_path.glob("*.mcap")]) > 0, "a recording")
        output.block()
        seen = len([*tmp_path.glob("*.mcap")])
        wait_until(lambda: len([*tmp_path.glob("*.mcap")]) > seen + 3, "more recordings")
        recorder.terminate()
        assert recorder.wait(LIMIT) == 0
