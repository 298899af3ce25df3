"""The process that answers clients: its limits, and its end."""

from __future__ import annotations

import itertools
import os
import select
import signal
import threading
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from bioscara import Pose, Robot
from bioscara.api import framing, messages as m
from bioscara.errors import BusyOwnerError, LeaseError, LimitError, OwnerLostError
from bioscara.planning.motions.waypoints import Waypoint
from bioscara.robot import tasks
from bioscara.server.channel import budget
from bioscara.server.clients.pauses import AUTHORS
from bioscara.server.serve import Served
from programs import LIMIT
from served import HALF, NAME, RawClient, arm_served, events_since, eventually


@pytest.fixture(scope="module")
def arm() -> Iterator[Served]:
    with arm_served(speed=1.0) as served:
        yield served


def api_processes() -> set[int]:
    """Return the processes of this test that answer clients: each has the memory of a history."""
    found = set()
    for path in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            if str(os.getpid()) in _ancestors(int(path.name)):
                files = map(os.readlink, (path / "fd").iterdir())
                if any(file.startswith("/memfd:bioscara-history") for file in files):
                    found.add(int(path.name))
    return found


def _ancestors(process: int) -> set[str]:
    found = set()
    while process > 1:
        found.add(str(process))
        status = Path(f"/proc/{process}/status").read_text()
        process = int(status.split("PPid:")[1].split()[0])
    return found


def raster(count: int) -> m.MakePlan:
    """Return the question for a path of many waypoints, which takes long to plan."""
    points = [
        Waypoint(Pose(0.35 + 0.02 * (row % 2), -0.1 + 0.2 * row / count, 0.15, 0.0))
        for row in range(count)
    ]
    return m.MakePlan(tasks.MoveSequence(waypoints=tuple(points)))


class Calls:
    """Counts the commands that reach the owner."""

    def __init__(self, served: Served, monkeypatch: pytest.MonkeyPatch) -> None:
        self.counted: Counter[str] = Counter()
        handle = served.owner.handle

        def counting(client: Any, command: Any, *given: Any) -> Any:
            self.counted[type(command).__name__] += 1
            return handle(client, command, *given)

        monkeypatch.setattr(served.owner, "handle", counting)


def flooded(stack: ExitStack, count: int, command: m.AnyCommand) -> threading.Event:
    """Let clients ask, each as fast as it is read, until the event that is returned is set."""
    ended, numbers = threading.Event(), itertools.count(1)

    def flood(client: RawClient) -> None:
        client.socket.setblocking(False)
        left = b""
        while not ended.is_set():
            if not left:
                # Equal questions would be asked once.
                asked = [
                    m.ClientRequest(
                        id=number,
                        command=m.GetGoal(number) if isinstance(command, m.GetGoal) else command,
                    )
                    for number in itertools.islice(numbers, 50)
                ]
                left = b"".join(map(framing.packed, asked))
            ready = select.select([client.socket], [client.socket], [], 0.05)
            with suppress(BlockingIOError):
                if ready[0]:
                    client.socket.recv(1 << 20)
                if ready[1]:
                    left = left[client.socket.send(left) :]

    for number in range(count):
        client = stack.enter_context(RawClient(f"greedy {number}"))
        thread = threading.Thread(target=flood, args=(client,))
        thread.start()
        stack.callback(thread.join)
    stack.callback(ended.set)
    return ended


@pytest.mark.parametrize("command", [m.GetGoal(1), m.RenewLease(), m.StopAll()])
def test_clients_that_do_not_command_reach_the_loop_as_often_as_they_may(
    arm: Served, monkeypatch: pytest.MonkeyPatch, command: m.AnyCommand
) -> None:
    calls, name = Calls(arm, monkeypatch), type(command).__name__
    with ExitStack() as stack:
        honest = stack.enter_context(RawClient("honest"))
        flooded(stack, 4, command)
        begin, before = time.monotonic(), calls.counted[name]
        for _ in range(3):
            honest.request(m.GetWorkspace())
        honest.request(m.StopAll())
        time.sleep(max(begin + 1.0 - time.monotonic(), 0.0))
        count, passed = calls.counted[name] - before, time.monotonic() - begin
    rate = budget.RATE if isinstance(command, m.Query) else budget.COMMANDS
    assert 10 < count < budget.BURST + 1.2 * rate * passed


def test_what_is_known_there_is_answered_without_the_loop(
    arm: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls, count = Calls(arm, monkeypatch), 1000
    with RawClient("looking") as client, RawClient("commanding") as other:
        epoch = other.acquire()
        for question in (m.GetState(), m.GetFaults(), m.GetWorkspace()):
            calls.counted.clear()
            answers = [client.request(question) for _ in range(count)]
            # A sample may come late; the rate of all is limited to that of one client in a second.
            assert calls.counted[type(question).__name__] < budget.RATE
            asker: Any = SimpleNamespace(session="", name="")
            asked = arm.owner.handle(asker, question, None)
            assert type(asked) is type(answers[-1])
            assert isinstance(question, m.GetState) or asked == answers[-1]
        # The client that commands is answered by the owner itself.
        calls.counted.clear()
        other.request(m.GetState())
        assert calls.counted["GetState"] == 1
        other.request(m.ReleaseLease(), epoch)


def test_a_client_reads_its_own_changes(arm: Served) -> None:
    with RawClient("looking") as client, RawClient("commanding") as other:
        for turn in range(50):
            client.request(m.Pause())
            # So does another one.
            for each in (client, other):
                assert each.request(m.GetState()).paused_by == ("looking",)
            epoch = other.acquire()
            other.request(m.Resume())
            other.request(m.SetSpeedOverride((turn + 1) / 50), epoch)
            assert other.request(m.GetState()).speed_override == (turn + 1) / 50
            other.request(m.ReleaseLease(), epoch)
            state = other.request(m.GetState())
            assert (state.paused_by, state.speed_override) == ((), (turn + 1) / 50)
            client.request(m.StopAll())


def test_an_event_is_seen_after_what_it_says(arm: Served) -> None:
    with RawClient("looking") as client, RawClient("commanding") as other:
        client.request(m.Subscribe(events_after=client.welcome.last_event))
        epoch = other.acquire()
        for number in range(20):
            client.events.clear()
            scene = m.SceneValue((), -0.001 * number, 0.01, None)
            other.request(m.Start(task=m.SetScene(scene=scene)), epoch)
            client.event("workspace")
            workspace = client.request(m.GetWorkspace())
            assert workspace.scene.table_height == pytest.approx(-0.001 * number)
            arm.robot.runner.arm.warn(f"warning {number}")
            client.event("warning")
            assert client.request(m.GetFaults()).warnings[-1] == f"warning {number}"
        other.request(m.ReleaseLease(), epoch)


def test_a_plan_is_bounded_and_ends_with_the_client_that_wants_it(arm: Served) -> None:
    with pytest.raises(LimitError, match="waypoints"):
        raster(1001)
    with RawClient("honest") as honest:
        with ExitStack() as stack:
            for number in range(3):
                leaving = stack.enter_context(RawClient(f"leaving {number}"))
                leaving.begin(raster(900))
            numbers = [leaving.begin(raster(900)) for _ in range(10)]
            refused = leaving.answer(numbers[-1])
            assert isinstance(refused, m.RequestFailed)
            assert refused.failure.error == BusyOwnerError.__name__
            time.sleep(0.2)
        begin = time.monotonic()
        made = honest.request(m.MakePlan(tasks.MoveJoints(positions=(0.1, 0.2, 0.6, 0.3))))
        # Each of the others takes longer.
        assert time.monotonic() - begin < 2.5
        assert made.points == len(made.trajectory.times)
        made = honest.request(raster(60))
        assert 1000 < len(made.trajectory.times) <= 2001 < made.points
        epoch = honest.acquire()
        begun = honest.request(m.Start(task=m.Execute(made.plan)), epoch)
        eventually(lambda: arm.robot.is_moving)
        whole, first = 0, 0
        while first == 0 or first < whole:
            part = honest.request(m.GetTrajectories(begun.goal.goal, first))
            whole, first = part.points, first + max(len(each.times) for each in part.trajectories)
        assert first == whole == made.points
        honest.request(m.StopAll())
        eventually(lambda: not arm.robot.is_moving)
        honest.request(m.ReleaseLease(), epoch)


def test_a_flood_of_pauses_grows_nothing(arm: Served) -> None:
    before = arm.owner.events.last
    with ExitStack() as stack:
        for number in range(AUTHORS):
            client = stack.enter_context(RawClient(f"pausing {number}"))
            for _ in range(3):
                client.request(m.Pause())
        client = stack.enter_context(RawClient("one too many"))
        with pytest.raises(BusyOwnerError, match="paused by"):
            client.request(m.Pause())
        assert arm.owner.sample.paused
    pauses = [event for event in events_since(arm, before) if event.what == "pause"]
    assert len(pauses) == AUTHORS
    with RawClient("lifting") as client:
        epoch = client.acquire()
        client.request(m.Resume())
        client.request(m.ReleaseLease(), epoch)
    assert not arm.robot.runner.arm.pauses


def test_points_are_taken_from_the_client_that_commands() -> None:
    with arm_served() as served, RawClient() as client:
        points = m.TrajectoryValue(("j1",), (0.0, 1.0), ((HALF[0],), (HALF[0] + 0.01,)), None, None)
        with pytest.raises(LeaseError):
            client.request(m.AddPoints(points=points))
        epoch = client.acquire()
        added = client.request(m.AddPoints(points=points), epoch)
        assert (added.upload, added.count) == (1, 2)
        assert served.robot.is_homed


def test_a_killed_process_is_started_again_and_stops_what_needs_the_lease() -> None:
    others = api_processes()
    with arm_served(speed=1.0) as served:
        (killed,) = api_processes() - others
        robot: Any = Robot.connect(f"arm:{NAME}").open()
        motion = robot.move_joints((HALF[0] - 0.5, *HALF[1:]), wait=False)
        eventually(lambda: served.robot.is_moving)
        before = served.owner.events.last
        os.kill(killed, signal.SIGKILL)
        begin = time.monotonic()
        eventually(lambda: not served.robot.is_moving)
        # Before its lease would lapse.
        assert time.monotonic() - begin < 1.8
        with pytest.raises(OwnerLostError):
            motion.result(LIMIT)
        robot.close()

        def answered() -> bool:
            with suppress(OSError, EOFError), RawClient() as client:
                return bool(client.request(m.GetState()).names)
            return False

        eventually(answered)
        assert killed not in api_processes()
        texts = [event.text for event in events_since(served, before)]
        assert any("is started again" in text for text in texts)
        assert not served.robot.faults
        with Robot.connect(f"arm:{NAME}") as again:
            again.move_relative(z=-0.002)
