"""Owners and clients as processes that are killed, stopped and starved."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from bioscara import Robot
from bioscara.api import messages as m
from bioscara.api.runtime import OwnerClaim, find, owners
from bioscara.errors import BioscaraError, BusyOwnerError, FaultedError, OwnerLostError
from bioscara.planning.motions.jog import JointVelocity
from bioscara.remote import RemoteRobot
from bioscara.remote.owner_socket import OwnerSocket
from bioscara.ros.owner_process import require_free
from bioscara.server import overlay_file
from bioscara.server.clients.client import Later
from bioscara.server.clients.events import Events
from bioscara.server.owner import run
from bioscara.server.serve import Served, ServeSettings, serving
from full_disk import full_after
from programs import environment, wait_for_line
from served import (
    HALF,
    NAME,
    RawClient,
    arm_served,
    events_since,
    eventually,
    memory_of,
    own_robot,
    runtime_folder,
)
from system.observed_arm import at_rest, truth

ARM = Path(__file__).parents[1] / "system/observed_arm.py"
CLIENT = """
import sys
from bioscara.api import messages as m
from bioscara.robot import tasks
from served import RawClient

task, on_loss, time_to_live = sys.argv[1], sys.argv[2], float(sys.argv[3])
known = {
    "follow": tasks.MoveJoints(positions=(0.9, 0.15, 0.2, 0.7), velocity_scaling=0.05),
    "jog": m.Jog(),
    "jaws": tasks.OpenGripper(),
}
with RawClient("doomed") as client:
    epoch = client.acquire(time_to_live=time_to_live)
    print("lease", flush=True)
    if task in known:
        client.request(m.Start(task=known[task], on_lease_loss=on_loss), epoch)
        print("begun", flush=True)
    while True:
        client.request(m.RenewLease(), epoch)
"""
Start = Callable[..., subprocess.Popen[str]]


@pytest.fixture
def folder() -> Iterator[Path]:
    with runtime_folder() as made:
        yield made


def served_by(start: Start, *options: str) -> subprocess.Popen[str]:
    """Start an owner in a process of its own; return it once clients can connect."""
    words = ("-m", "bioscara", "serve", "--name", NAME, *options)
    process = start(*words, env=environment(), stderr=subprocess.DEVNULL)
    wait_for_line(process, "is served")
    return process


def test_a_killed_owner_leaves_joints_that_stop_and_a_fault_for_the_next_one(
    start: Start, folder: Path, tmp_path: Path
) -> None:
    path = folder / "arm.sock"
    wait_for_line(start(str(ARM), str(path), "homed", env=environment()), "listening")
    options = ("--bus", f"sim:{path}", "--evidence", str(tmp_path))
    owner = served_by(start, *options)
    robot: Any = Robot.connect(f"arm:{NAME}")
    with robot:
        operation = robot.jog(lambda: JointVelocity(0.3), wait=False)
        eventually(lambda: abs(truth(path)[1][0]) > 0.1, what="the joint moves")
        owner.kill()
        eventually(lambda: at_rest(path), 2.0, "the joints stop by themselves")
        with pytest.raises(BioscaraError):
            operation.result(20.0)
        # Neither its lock nor its socket keeps the next one from starting.
        assert find_error() is OwnerLostError
        second = served_by(start, *options)
        assert find(NAME).pid == second.pid
        assert robot.faults
        robot.acquire_lease()
        with pytest.raises(FaultedError):
            robot.home()
        robot.acknowledge()
        robot.recover()
        assert robot.faults == ()
        second.terminate()
        assert second.wait(20.0) == 0


def test_the_gateways_of_a_killed_owner_end_with_it(
    start: Start, folder: Path, tmp_path: Path
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    words = ("--bus", "sim", "--with", "record", "--with", f"web --port {port}")
    first = start(
        *("-m", "bioscara", "serve", "--name", NAME, *words),
        env=environment(BIOSCARA_RUNTIME=str(folder)),
        cwd=tmp_path,
        stderr=subprocess.STDOUT,
    )
    begun = [int(wait_for_line(first, "runs as process").split()[-1]) for _ in range(2)]
    wait_for_line(first, f"http://127.0.0.1:{port}")
    eventually(lambda: [*tmp_path.glob("recordings/*.mcap")], what="the recorder begins")
    first.kill()
    eventually(lambda: not any(Path(f"/proc/{pid}/exe").exists() for pid in begun))
    # The recording is whole, and the next owner's gateway has the port.
    (recording,) = tmp_path.glob("recordings/*.mcap")
    assert recording.read_bytes().endswith(b"\x89MCAP0\r\n")
    second = start(
        *("-m", "bioscara", "serve", "--name", NAME, *words[:2], *words[4:]),
        env=environment(BIOSCARA_RUNTIME=str(folder)),
        cwd=tmp_path,
        stderr=subprocess.STDOUT,
    )
    wait_for_line(second, f"http://127.0.0.1:{port}")
    second.terminate()
    assert second.wait(20.0) == 0


def find_error() -> type[Exception] | None:
    try:
        find(NAME)
    except OwnerLostError as error:
        return type(error)
    return None


@pytest.fixture(scope="module")
def arm() -> Iterator[Served]:
    with arm_served(speed=5.0) as served:
        yield served


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
@pytest.mark.parametrize(
    ("task", "on_loss"),
    [
        ("follow", "stop"),
        ("follow", "finish"),
        ("jog", "finish"),
        ("jaws", "stop"),
        ("nothing", "stop"),
    ],
)
def test_the_goal_of_a_client_that_fell_silent_ends_as_it_said(
    start: Start, arm: Served, number: int, task: str, on_loss: str
) -> None:
    arm.robot.move_joints(HALF, wait=False).wait(20.0)
    last = arm.owner.events.last
    client = start("-c", CLIENT, task, on_loss, "0.3", env=environment())
    wait_for_line(client, "lease" if task == "nothing" else "begun")
    client.send_signal(number)
    try:
        eventually(lambda: not arm.owner.lease.holder, 5.0, "the lease lapses")
        if on_loss == "finish" and task == "follow":
            assert arm.owner.goals.running
        else:
            eventually(lambda: not arm.owner.goals.running, 5.0, "it stops")
        said = "lapsed" if number == signal.SIGSTOP else "has ended, and its lease with it"
        assert any(
            event.what == "lease" and said in event.text for event in events_since(arm, last)
        )
        with RawClient("next") as other:
            # Another one may command now, and stop the goal.
            epoch = other.acquire()
            other.request(m.StopAll())
            eventually(lambda: not arm.robot.is_moving, 10.0)
            other.request(m.ReleaseLease(), epoch)
    finally:
        client.send_signal(signal.SIGCONT)


def test_a_client_that_was_stopped_commands_nothing_when_it_goes_on(
    start: Start, arm: Served
) -> None:
    client = start(
        "-c", CLIENT, "nothing", "stop", "0.3", env=environment(), stderr=subprocess.PIPE
    )
    wait_for_line(client, "lease")
    client.send_signal(signal.SIGSTOP)
    eventually(lambda: not arm.owner.lease.holder, 5.0)
    client.send_signal(signal.SIGCONT)
    _, errors = client.communicate(timeout=20.0)
    assert "LeaseError" in errors


def test_a_stopped_subscriber_delays_no_other_client(start: Start, arm: Served) -> None:
    program = (
        "from bioscara.api import messages as m\n"
        "from served import RawClient\n"
        "client = RawClient('deaf')\n"
        "client.begin(m.Subscribe(states=True, events_after=0))\n"
        "print('subscribed', flush=True)\n"
        "while True:\n"
        "    client.read(m.StateSample)\n"
    )
    client = start("-c", program, env=environment())
    wait_for_line(client, "subscribed")
    with RawClient("look") as look:
        before = memory_of(look)
    client.send_signal(signal.SIGSTOP)
    cycle = arm.owner.sample.cycle
    eventually(lambda: arm.owner.sample.cycle > cycle + 1000)
    with RawClient("look") as look:
        assert memory_of(look) - before < 64 << 20
    client.send_signal(signal.SIGCONT)


def test_an_owner_that_is_stopped_is_reported_and_used_again_when_it_goes_on(
    start: Start, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert folder.is_dir()
    monkeypatch.setattr("bioscara.remote.link._ANSWER_TIMEOUT", 0.5)
    monkeypatch.setattr("bioscara.remote.lease_keeper.PATIENCE", 0.5)
    owner = served_by(start, "--bus", "sim", "--real-time-factor", "10")
    robot: Any = Robot.connect(f"arm:{NAME}")
    with robot:
        robot.acquire_lease()
        owner.send_signal(signal.SIGSTOP)
        with pytest.raises(OwnerLostError, match="has not answered"):
            _ = robot.state
        # The end of a program does not wait for it either.
        begin = time.monotonic()
        robot.close()
        assert time.monotonic() - begin < 2.0
        owner.send_signal(signal.SIGCONT)
    with Robot.connect(f"arm:{NAME}") as robot:
        eventually(lambda: answers(robot))


def test_a_silent_owner_is_reported_in_time_and_gets_no_late_command(
    start: Start, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert folder.is_dir()
    monkeypatch.setattr(OwnerSocket, "silence", 0.5)
    owner = served_by(start, "--bus", "sim", "--real-time-factor", "10")
    with RemoteRobot(NAME) as robot:
        robot.controllers.subscribe(lambda _: None)
        robot.enable()
        owner.send_signal(signal.SIGSTOP)
        begin = time.monotonic()
        with pytest.raises(OwnerLostError, match="has been silent"):
            _ = robot.state
        with pytest.raises(OwnerLostError, match="has been silent"):
            robot.disable()
        # Each waits for as long as the silence is tolerated at most.
        assert time.monotonic() - begin < 2 * 0.5 + 1.0
        owner.send_signal(signal.SIGCONT)
        eventually(lambda: answers(robot))
        assert robot.is_enabled


def answers(robot: Any) -> bool:
    with suppress(OwnerLostError):
        return bool(robot.state)
    return False


def test_a_removed_folder_is_made_again(folder: Path) -> None:
    with serving(own_robot(folder), ServeSettings(NAME, "sim")):
        shutil.rmtree(folder)
        eventually(lambda: find_error() is None and can_connect(), 5.0)
        assert [each.name for each in owners()] == [NAME]
        find(NAME).socket.unlink()
        eventually(can_connect, 5.0)
        with pytest.raises(BusyOwnerError):
            OwnerClaim(NAME, "sim")
    assert owners() == []


def can_connect() -> bool:
    try:
        with RawClient():
            return True
    except OSError:
        return False
    except BioscaraError:
        return False


def test_a_stale_socket_is_replaced(folder: Path) -> None:
    path = folder / f"{NAME}.sock"
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as stale:
        stale.bind(os.fspath(path))
    (folder / f"{NAME}.lock").write_text('{"pid": 1, "bus": "linux:1"}')
    assert find_error() is OwnerLostError
    with serving(own_robot(folder), ServeSettings(NAME, "sim")):
        assert find(NAME).pid == os.getpid()
        assert can_connect()


def test_the_second_owner_of_a_name_is_refused_and_harms_nothing(
    start: Start, folder: Path
) -> None:
    owner = served_by(start, "--bus", "sim")
    begun = start(
        *("-m", "bioscara", "serve", "--name", NAME, "--bus", "sim"),
        env=environment(),
        stderr=subprocess.PIPE,
    )
    _, errors = begun.communicate(timeout=20.0)
    assert begun.returncode != 0
    assert f"arm {NAME} has an owner, process {owner.pid} on sim" in errors
    with pytest.raises(BusyOwnerError, match=f"process {owner.pid} on sim; leave out --bus"):
        require_free(NAME)
    require_free("right")
    assert can_connect()
    assert (folder / f"{NAME}.sock").is_socket()
    other = served_by(start, "--bus", "sim", "--name", "right")
    assert {each.name for each in owners()} == {NAME, "right"}
    other.terminate()
    assert other.wait(20.0) == 0
    assert [each.name for each in owners()] == [NAME]


OVERLAY = "joints: {}\n# of this arm\n"


def overlay_request(arm: Served, text: str, revision: int = 1) -> m.AnyResult:
    class Caller:
        session, name, connected, gone = "caller", "caller", True, False

        def send_record(self, goal: int, record: object) -> None:
            """Take a record."""

    caller: Any = Caller()
    state = arm.owner.handle(caller, m.AcquireLease(), None)
    assert isinstance(state, m.LeaseState)
    command = m.SetParameters(overlay=text, revision=revision)
    try:
        result = arm.owner.handle(caller, command, state.lease.epoch)
        assert isinstance(result, Later)
        return run(result)
    finally:
        arm.owner.handle(caller, m.ReleaseLease(), state.lease.epoch)


def test_an_overlay_that_cannot_be_written_stays_as_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "arm.yaml"
    file.write_text("")
    with arm_served(overlay=file) as arm:
        with full_after(5), pytest.raises(OSError, match="large"):
            overlay_request(arm, OVERLAY)
        assert file.read_text() == ""

        def refuse(_: Path) -> Any:
            raise PermissionError(13, "Permission denied", os.fspath(file))

        with monkeypatch.context() as patched:
            patched.setattr(overlay_file, "replacing", refuse)
            with pytest.raises(PermissionError):
                overlay_request(arm, OVERLAY)
        assert file.read_text() == ""
        written = overlay_request(arm, OVERLAY)
        assert isinstance(written, m.ParametersState)
        assert (written.revision, written.restart) == (2, True)
        assert file.read_text() == OVERLAY
        assert list(tmp_path.iterdir()) == [file]


def test_a_step_of_the_clock_on_the_wall_disturbs_no_order() -> None:
    wall = [1_000.0]
    arm_clock = [0.0]
    events = Events(lambda: arm_clock[0], lambda: wall[0])
    for step in (0.0, 3600.0, -86_400.0, 1.0):
        wall[0] += step
        arm_clock[0] += 1.0
        events.add("warning", f"after a step of {step:g} s")
    found, number = [], 0
    while (event := events.after(number)) is not None:
        found.append(event)
        number = event.number
    assert [event.number for event in found] == [1, 2, 3, 4]
    times = [event.time for event in found]
    assert times == sorted(times)
    assert found[2].wall < found[1].wall
