"""However a program ends, short of SIGKILL, the arm is at rest and released, without a fault."""

from __future__ import annotations

import configparser
import re
import shlex
import signal
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from bioscara import Robot
from bioscara.robot.connection import exit_guard
from programs import LIMIT, environment, running, wait_for_line, wait_until
from robot.connection import ended_program
from system.observed_arm import at_rest, energised, truth

ROOT = Path(__file__).parents[3]
RESTING = 0.1
"""Speed below which a joint that brakes is at rest but for its belt [rad/s]."""

Start = Callable[..., subprocess.Popen[str]]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("ended")


@pytest.fixture(scope="module")
def arm(folder: Path) -> Iterator[Path]:
    path = folder / "arm.sock"
    words = ("-m", "tests.system.observed_arm", str(path), "homed")
    with running(*words, cwd=folder, env=environment(TMPDIR=str(folder))) as process:
        wait_for_line(process, "listening")
        yield path
        process.terminate()
        assert process.wait(LIMIT) == 0


@pytest.fixture
def begin(start: Start, arm: Path, folder: Path) -> Callable[..., subprocess.Popen[str]]:
    """Start one of the programs, and return once it has said that it moves the arm."""

    def begun(kind: str, says: str = "moving", **options: object) -> subprocess.Popen[str]:
        process = start(
            *("-m", ended_program.__name__, kind, str(arm)),
            cwd=folder,
            env=environment(TMPDIR=str(folder)),
            stderr=subprocess.PIPE,
            **options,
        )
        wait_for_line(process, says)
        return process

    return begun


def require_released(arm: Path, folder: Path) -> None:
    """Require an arm at rest, without current, homed, and without a fault."""
    assert energised(arm) == []
    assert abs(truth(arm)[1][0]) < RESTING
    wait_until(lambda: at_rest(arm), "the belts swing out")
    with Robot.connect(f"sim:{arm}", evidence=folder / "after") as robot:
        assert robot.faults == ()
        assert robot.is_homed


def ended(process: subprocess.Popen[str]) -> tuple[int, str]:
    """Return the exit status of a program that ends now, and its standard error."""
    _, errors = process.communicate(timeout=LIMIT)
    return process.returncode, errors


@pytest.mark.parametrize(
    ("kind", "number"),
    [
        ("in_a_with_that_sleeps", signal.SIGTERM),
        ("waiting_for_the_result", signal.SIGTERM),
        ("watched", signal.SIGTERM),
        # Both signals have one handler, so one program shows that this one has it too.
        ("opened", signal.SIGHUP),
    ],
    ids=lambda each: getattr(each, "name", None),
)
def test_host10_a_signal_in_mid_motion_releases_the_arm_at_rest(
    begin: Start, arm: Path, folder: Path, kind: str, number: signal.Signals
) -> None:
    process = begin(kind)
    process.send_signal(number)
    status, errors = ended(process)
    assert (status, errors) == (128 + number, ""), errors
    require_released(arm, folder)


@pytest.mark.parametrize(
    ("kind", "status", "message"),
    [("returning", 0, ""), ("exiting", 3, ""), ("raising", 1, "ZeroDivisionError\n")],
)
def test_host10_a_program_that_ends_without_close_releases_the_arm_at_rest(
    begin: Start, arm: Path, folder: Path, kind: str, status: int, message: str
) -> None:
    returned, errors = ended(begin(kind, cold=True))
    assert returned == status
    assert errors.rpartition("    raise ")[2].rpartition("\n\n")[2].endswith(message)
    assert ("Traceback" in errors) == (message != "")
    require_released(arm, folder)


@pytest.mark.parametrize(
    ("kind", "number"),
    [
        ("in_a_with_that_waits", signal.SIGTERM),
        ("returning", signal.SIGTERM),
        # As of a key that is held.
        ("opened", signal.SIGINT),
    ],
    ids=lambda each: getattr(each, "name", None),
)
def test_signals_that_repeat_end_nothing_before_the_arm_is_released(
    begin: Start, arm: Path, folder: Path, kind: str, number: signal.Signals
) -> None:
    process = begin(kind, cold=True)
    sent_until = time.monotonic() + LIMIT
    while process.poll() is None:
        assert time.monotonic() < sent_until
        process.send_signal(number)
        # In the first kind they interrupt the control loop: in each cycle.
        time.sleep(0.005 if kind == "in_a_with_that_waits" else 0.02)
    status, errors = ended(process)
    # Once the arm is released, a signal ends the program at once.
    assert status in {128 + number, -number, *([0] if kind == "returning" else [])}
    if number == signal.SIGINT:
        assert "KeyboardInterrupt" in errors
    elif kind != "returning" or not errors.startswith("Exception ignored in: <module 'threading'"):
        # Python reports a signal that arrives while it joins the threads, and goes on.
        assert errors == ""
    require_released(arm, folder)


def test_a_program_handles_its_signals_itself_if_it_did_before(
    begin: Start, arm: Path, folder: Path
) -> None:
    process = begin("handling_the_signal")
    process.send_signal(signal.SIGTERM)
    wait_for_line(process, f"handled {signal.SIGTERM:d}")
    assert ended(process) == (0, "")
    require_released(arm, folder)


def test_a_hangup_that_is_ignored_stays_ignored(begin: Start, arm: Path, folder: Path) -> None:
    process = begin(
        "opened", cold=True, preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN)
    )
    process.send_signal(signal.SIGHUP)
    time.sleep(0.3)
    assert process.poll() is None
    assert abs(truth(arm)[1][0]) > ended_program.FAST
    process.send_signal(signal.SIGTERM)
    assert ended(process)[0] == 128 + signal.SIGTERM
    require_released(arm, folder)


def test_a_closing_that_a_signal_ends_keeps_no_other_robot_open() -> None:
    class Arm:
        closed = False

        def __init__(self, error: BaseException | None) -> None:
            self.error = error

        def close(self) -> None:
            self.closed = True
            if self.error is not None:
                raise self.error

    arms = [Arm(error) for error in (SystemExit(143), KeyboardInterrupt(), None)]
    for each in arms:
        exit_guard.guard(each, lambda: None)
    try:
        exit_guard._close_all()
        assert all(each.closed for each in arms)
    finally:
        for each in arms:
            exit_guard.forget(each)


def test_a_forked_child_does_nothing_to_the_arm_of_its_parent(
    begin: Start, arm: Path, folder: Path
) -> None:
    process = begin("forking", cold=True)
    text = f"refused: NotInitializedError: the robot belongs to process {process.pid}, from which"
    for _ in range(10):
        assert text in wait_for_line(process, "refused")
    wait_for_line(process, "open False")
    wait_for_line(process, "forked False")
    # A copy of the connection in the child, which lives on, would keep the arm from the next host.
    process.kill()
    process.wait(LIMIT)
    wait_until(lambda: at_rest(arm), "the joints stop by themselves")
    with Robot.connect(f"sim:{arm}", evidence=folder / "forked") as robot:
        robot.acknowledge()
        robot.recover()
        robot.enable()
    require_released(arm, folder)


def test_after_close_a_signal_ends_the_program_at_once(begin: Start) -> None:
    process = begin("closed", says="closed")
    process.send_signal(signal.SIGTERM)
    assert ended(process) == (-signal.SIGTERM, "")


def unit() -> configparser.ConfigParser:
    """Return the unit file of the documentation."""
    text = (ROOT / "docs/loop.md").read_text()
    (block,) = re.findall(r"^    \[Unit\]\n(?:(?:    .*)?\n)+", text, re.MULTILINE)
    parser = configparser.ConfigParser(strict=True)
    parser.optionxform = str  # type: ignore[assignment,method-assign]  # names keep their case
    parser.read_string(re.sub(r"^    ", "", block, flags=re.MULTILINE))
    return parser


def service(folder: Path, arm: Path) -> Path:
    """Write the program of the documentation's unit, for the arm of the test."""
    text = (ROOT / "docs/loop.md").read_text()
    (block,) = re.findall(r"^    # service\.py\n(?:(?:    .*)?\n)+", text, re.MULTILINE)
    program = re.sub(r"^    ", "", block, flags=re.MULTILINE)
    assert program.count("linux:1") == 1
    path = folder / "service.py"
    path.write_text(program.replace("linux:1", f"sim:{arm}"))
    return path


def test_the_unit_is_enabled_and_restarted_in_mid_motion(
    start: Start, arm: Path, folder: Path
) -> None:
    parsed = unit()
    assert parsed["Unit"]["Description"]
    assert parsed["Install"]["WantedBy"] == "multi-user.target"
    assert parsed["Service"]["Type"] == "notify"
    good = {int(number) for number in parsed["Service"]["SuccessExitStatus"].split()}
    command = shlex.split(parsed["Service"]["ExecStart"])
    assert command[0].endswith("/.venv/bin/python")
    program = service(folder, arm)
    assert [Path(word).name for word in command[1:]] == [program.name]
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(str(folder / "notify"))
        systemd.settimeout(LIMIT)
        env = environment(NOTIFY_SOCKET=str(folder / "notify"), TMPDIR=str(folder))
        for number in (signal.SIGTERM, signal.SIGHUP):
            process = start(str(program), cwd=folder, env=env, stderr=subprocess.PIPE)
            assert systemd.recv(100) == b"READY=1"
            wait_until(lambda: max(map(abs, truth(arm)[1])) > ended_program.FAST, "it moves")
            process.send_signal(number)
            status, errors = ended(process)
            assert status in good, errors
            assert errors == ""
            require_released(arm, folder)
