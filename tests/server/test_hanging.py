"""Processes of a served arm that hang: they are replaced as dead ones are, and STOP works."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from bioscara import Robot
from bioscara.api import messages as m
from bioscara.api.runtime import find
from bioscara.errors import OwnerLostError
from bioscara.robot import tasks
from bioscara.stop import main as stop
from processes_of import members, only
from programs import environment, wait_for_line
from served import NAME, RawClient, eventually, runtime_folder

Start = Callable[..., subprocess.Popen[str]]
FAR = tasks.MoveJoints(positions=(0.9, 0.15, 0.2, 0.7), velocity_scaling=0.05)


@pytest.fixture
def folder() -> Iterator[Path]:
    with runtime_folder() as made:
        yield made


def served(start: Start, folder: Path, *options: str) -> subprocess.Popen[str]:
    """Start an owner in a process of its own, whose heartbeats were answered once."""
    process = start(
        *("-m", "bioscara", "serve", "--name", NAME, "--homed", *options),
        env=environment(BIOSCARA_RUNTIME=str(folder)),
        cwd=folder,
        stderr=subprocess.STDOUT,
    )
    wait_for_line(process, "is served")
    time.sleep(0.5)
    return process


def texts() -> str:
    """Return the events of the owner until now, in words."""
    with RawClient("reader") as client:
        client.request(m.Subscribe(events_after=0))
        while not client.events or client.events[-1].number < client.welcome.last_event:
            client.read(m.Event)
    return "\n".join(event.text for event in client.events)


def moving(client: RawClient, on_lease_loss: m.OnLeaseLoss = "finish") -> int:
    """Begin a motion of some seconds; return its goal."""
    epoch = client.acquire()
    client.request(m.Start(task=tasks.Enable()), epoch)
    eventually(lambda: not client.request(m.GetState()).moving)
    started = client.request(m.Start(task=FAR, on_lease_loss=on_lease_loss), epoch)
    eventually(lambda: abs(client.request(m.GetState()).velocities[0]) > 1e-3)
    return int(started.goal.goal)


def test_a_hanging_process_of_the_clients_is_replaced_and_goals_that_may_finish_go_on(
    start: Start, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    owner = served(start, folder)
    hung = only(owner, "bioscara-api")
    with RawClient("mover") as client:
        goal = moving(client)
    os.kill(hung, signal.SIGSTOP)
    eventually(lambda: hung not in members(owner, "bioscara-api"), what="it is killed")
    eventually(lambda: members(owner, "bioscara-api"), what="it is begun anew")
    eventually(can_connect)
    with RawClient("look") as client:
        assert client.request(m.GetGoal(goal)).goal.status == "running"
        assert "the process that answers the clients hangs, and is killed" in texts()
        # STOP while it hangs takes the other way, and ends the goal.
        os.kill(only(owner, "bioscara-api"), signal.SIGSTOP)
        begin = time.monotonic()
        assert stop([NAME]) == 0
        assert time.monotonic() - begin < 1.0
        assert "was stopped" in capsys.readouterr().out
    eventually(can_connect)
    with RawClient("look") as client:
        assert client.request(m.GetGoal(goal)).goal.status == "cancelled"


def can_connect() -> bool:
    try:
        with RawClient("look") as client:
            return bool(client.request(m.GetState()))
    except OSError:
        return False


def test_a_hanging_process_from_which_others_fork_is_replaced_before_the_clients(
    start: Start, folder: Path
) -> None:
    owner = served(start, folder)
    hung, killed = only(owner, "bioscara-forks"), only(owner, "bioscara-api")
    with RawClient("mover") as client:
        goal = moving(client)
    os.kill(hung, signal.SIGSTOP)
    os.kill(killed, signal.SIGKILL)
    assert stop([NAME]) == 0
    eventually(lambda: members(owner, "bioscara-forks") - {hung})
    eventually(lambda: members(owner, "bioscara-api") - {killed})
    eventually(can_connect)
    with RawClient("look") as client:
        assert client.request(m.GetGoal(goal)).goal.status == "cancelled"
        # Workers fork from the new one.
        motion = tasks.MoveJoints(positions=(0.2, 0.2, 0.5, 0.2))
        assert client.request(m.MakePlan(motion)).points


def test_a_hanging_gateway_is_replaced_only_if_the_owner_has_begun_it(
    start: Start, folder: Path
) -> None:
    owner = served(start, folder, "--with", "web --port 0", "--with", "record")
    wait_for_line(owner, "on the web")
    names = ("web", "record")
    eventually(lambda: all(gateway_of(owner, each) for each in names))
    gateways = {each: gateway_of(owner, each) for each in names}
    by_hand = start(
        *("-m", "bioscara", "web", "--port", "0", "--arm", NAME),
        env=environment(BIOSCARA_RUNTIME=str(folder)),
        cwd=folder,
        stderr=subprocess.STDOUT,
    )
    wait_for_line(by_hand, "on the web")
    # The gateways have answered once.
    time.sleep(3.0)
    for pid in (*gateways.values(), by_hand.pid):
        os.kill(pid, signal.SIGSTOP)
    for name, pid in gateways.items():
        eventually(partial(has_ended, pid), what=f"{name} is killed")
    assert {f"{name} hangs, and is killed" for name in gateways} <= {*texts().split("\n")}
    eventually(lambda: {gateway_of(owner, each) for each in gateways}.isdisjoint(gateways.values()))
    assert state_of(by_hand.pid) == "T"
    by_hand.send_signal(signal.SIGCONT)


def gateway_of(owner: subprocess.Popen[str], name: str) -> int:
    """Return the process of a gateway that an owner has begun; 0 while there is none."""
    children = Path(f"/proc/{owner.pid}/task/{owner.pid}/children").read_text().split()
    for pid in map(int, children):
        words = Path(f"/proc/{pid}/cmdline").read_text().split("\0")
        if "bioscara" in words and name in words and state_of(pid) != "Z":
            return pid
    return 0


def state_of(pid: int) -> str:
    """Return the state of a process, a letter; '-' if there is none."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(") ")[2][0]
    except OSError:
        return "-"


def has_ended(pid: int) -> bool:
    return state_of(pid) in "Z-"


def test_a_suspended_group_goes_on_as_it_was(start: Start, folder: Path) -> None:
    owner = served(start, folder, "--with", "web --port 0")
    time.sleep(3.0)
    names = ("bioscara-api", "bioscara-forks", "bioscara-worker")
    before = [members(owner, name) for name in names]
    os.killpg(owner.pid, signal.SIGSTOP)
    time.sleep(2.5)
    os.killpg(owner.pid, signal.SIGCONT)
    eventually(can_connect)
    time.sleep(1.5)
    assert [members(owner, name) for name in names] == before
    assert not re.search("hangs|has ended|started again", texts())


def test_a_suspended_owner_is_reported_after_two_seconds(start: Start, folder: Path) -> None:
    owner = served(start, folder)
    with Robot.connect(f"arm:{NAME}") as robot:
        robot.enable()
        motion = robot.move_joints(FAR.positions, velocity_scaling=0.05, wait=False)
        calls: list[Callable[[], object]] = [
            lambda: robot.state,
            motion.result,
            lambda: robot.faults,
        ]
        for call in calls:
            for suspend in (owner.send_signal, partial(os.killpg, owner.pid)):
                suspend(signal.SIGSTOP)
                begin = time.monotonic()
                # A state of the last moment before is the state.
                time.sleep(0.3)
                with pytest.raises(OwnerLostError, match=r"has been silent for \d\.\d s"):
                    call()
                assert time.monotonic() - begin < 6.0
                os.killpg(owner.pid, signal.SIGCONT)
                eventually(lambda: answers(robot))


def answers(robot: Any) -> bool:
    try:
        return bool(robot.state)
    except OwnerLostError:
        return False


def test_the_socket_for_stop_takes_stops_and_nothing_else(start: Start, folder: Path) -> None:
    owner = served(start, folder)
    path = find(NAME).stop_socket
    assert path.stat().st_mode & 0o777 == 0o600
    with RawClient("mover") as client:
        goal = moving(client, "stop")

        def ask(message: bytes) -> bytes:
            with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as connection:
                connection.settimeout(5.0)
                connection.connect(os.fspath(path))
                if message:
                    connection.send(message)
                return connection.recv(100)

        words = b'{"kind":"stop","client":"c","session":"s"}'
        wrong = (b"", b"x", b"[]", b"{}", b"7", words[:-1], b'{"kind":"go"}', b"[" * 4000)
        more = (b'{"kind":"stop","client":7,"session":"s"}', b"\xff", b"x" * 100_000)
        for message in (*wrong, *more):
            assert ask(message) == b""
        assert client.request(m.GetGoal(goal)).goal.status == "running"
        # More than are taken at once wait no longer than these may.
        silent = [socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) for _ in range(40)]
        for each in silent:
            each.connect(os.fspath(path))
        begin = time.monotonic()
        assert b"done" in ask(words)
        assert time.monotonic() - begin < 1.0
        eventually(lambda: client.request(m.GetGoal(goal)).goal.status == "cancelled")
        # Another client has stopped it, which ended the lease.
        assert "c stopped all motion, and ended the lease of mover" in texts()
        for each in silent:
            each.close()
        path.unlink()
        eventually(path.is_socket, what="it is made again")
        assert b"done" in ask(words)
    owner.terminate()
    assert owner.wait(20.0) == 0
    assert not path.exists()
