"""A connection that breaks at any moment: nothing is lost, and nothing is carried out twice."""

from __future__ import annotations

import os
import random
import socket
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest

from bioscara import Robot
from bioscara.api import framing, messages as m
from bioscara.api.runtime import find
from bioscara.errors import (
    BusyError,
    InvalidArgumentError,
    LeaseError,
    MotionCancelledError,
    OwnerLostError,
)
from bioscara.remote import link as link_module
from bioscara.remote.link import OwnerLink
from bioscara.remote.owner_socket import OwnerSocket
from bioscara.report import CycleRecord
from bioscara.server.clients import connection, events
from bioscara.server.serve import Served, ServeSettings, serving
from programs import wait_until
from remote.cutting_proxy import DOWN, UP, Proxy
from served import HALF, NAME, RawClient, arm_served, events_since, eventually, own_robot
from simulated import NAMES

LONG = (0.9, 0.15, 0.2, 0.7)


@contextmanager
def proxied(served: Served) -> Iterator[Proxy]:
    assert served.robot.is_homed
    path = find(NAME).socket
    real = path.with_suffix(".real")
    path.rename(real)
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    listener.bind(os.fspath(path))
    with closing(Proxy(listener, socket.AF_UNIX, os.fspath(real))) as proxy:
        yield proxy


def real_socket() -> Path:
    """Return the owner's socket behind the proxy."""
    return find(NAME).socket.with_suffix(".real")


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    with arm_served(speed=500.0) as made:
        yield made


@pytest.fixture(scope="module")
def proxy(served: Served) -> Iterator[Proxy]:
    with proxied(served) as made:
        yield made


@pytest.fixture
def robot(proxy: Proxy) -> Iterator[Any]:
    proxy.accepting = True
    with Robot.connect(f"arm:{NAME}") as made:
        yield made


def size_of_a_motion(proxy: Proxy, robot: Any) -> dict[str, int]:
    before = dict(proxy.passed)
    robot.move_relative(z=0.002)
    robot.move_relative(z=-0.002)
    return {way: (proxy.passed[way] - before[way]) // 2 for way in (UP, DOWN)}


@pytest.mark.parametrize("direction", [UP, DOWN])
def test_a_goal_is_carried_out_once_wherever_the_connection_breaks(
    served: Served, proxy: Proxy, robot: Any, direction: str
) -> None:
    size = size_of_a_motion(proxy, robot)[direction]
    assert size > 50
    # Not beyond the end: a cut that is left over would happen during the next motion.
    points = range(0, size, max(size // 12, 1))
    sign = 1.0
    for count in points:
        goals, height = served.owner.goals.last, robot.pose.z
        proxy.cut_after(direction, count)
        robot.move_relative(z=sign * 0.002)
        assert served.owner.goals.last == goals + 1, f"cut after {count} bytes {direction}"
        assert robot.pose.z - height == pytest.approx(sign * 0.002, abs=5e-4)
        sign = -sign


def test_answers_of_all_threads_come_through_random_breaks(proxy: Proxy, robot: Any) -> None:
    choice, stop = random.Random(1), threading.Event()
    wrong: list[BaseException] = []

    def ask() -> None:
        try:
            while not stop.is_set():
                assert robot.state.names == NAMES
                robot.speed_override = 1.0
        except BaseException as error:  # noqa: BLE001  reported by the test
            wrong.append(error)

    threads = [threading.Thread(target=ask) for _ in range(4)]
    for thread in threads:
        thread.start()
    for _ in range(25):
        way = choice.choice((UP, DOWN))
        before = proxy.passed[way]
        proxy.cut_after(way, choice.randrange(5000))
        # Of this turn alone: it is called in this turn.
        eventually(lambda: proxy.passed[way] > before + 5000 or wrong)  # noqa: B023
    stop.set()
    for thread in threads:
        thread.join()
    assert wrong == []


def test_events_go_on_without_a_gap_after_each_break(served: Served, proxy: Proxy) -> None:
    numbers: list[int] = []

    def receive(message: m.FromOwner) -> None:
        if isinstance(message, m.Event):
            numbers.append(message.number)

    listener = OwnerLink(NAME, receive, lambda _: None)
    listener.open()
    first = served.owner.events.last
    with RawClient("noisy", path=real_socket()) as noisy:
        for count in range(60):
            noisy.request(m.Pause())
            if count % 10 == 5:
                proxy.cut_after(DOWN, 7 * count)
        noisy.request(m.StopAll())
    last = served.owner.events.last
    eventually(lambda: numbers and numbers[-1] >= last)
    listener.close()
    assert numbers == list(range(numbers[0], numbers[-1] + 1))
    assert numbers[0] <= first + 1


def test_records_go_on_after_a_break(
    served: Served, proxy: Proxy, robot: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Records of thousands of cycles in a second would keep this process from renewing the lease.
    monkeypatch.setattr(served.robot.clock, "real_time_factor", 5.0)
    records: list[CycleRecord] = []
    begun = threading.Event()

    def take(record: CycleRecord) -> None:
        records.append(record)
        begun.set()

    robot.speed_override = 0.02
    operation = robot.move_joints(LONG, on_cycle=take, wait=False)
    assert begun.wait(10.0)
    proxy.cut()
    count = len(records)
    eventually(lambda: len(records) > count + 50)
    robot.speed_override = 1.0
    operation.result(20.0)
    robot.move_joints(HALF)


def test_a_motion_goes_on_while_its_client_connects_again(proxy: Proxy, robot: Any) -> None:
    robot.speed_override = 0.02
    operation = robot.move_joints(LONG, wait=False)
    for _ in range(5):
        proxy.cut()
        assert not operation.done
        assert operation.progress < 1.0
    robot.speed_override = 1.0
    assert operation.result(10.0) is None
    robot.move_joints(HALF)


def test_a_client_that_missed_the_end_of_its_motion_asks_for_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(events, "KEPT", 20)
    with (
        arm_served(speed=500.0) as served,
        proxied(served) as proxy,
        Robot.connect(f"arm:{NAME}") as robot,
    ):
        robot.speed_override = 0.02
        operation = robot.move_joints(LONG, wait=False)
        proxy.accepting = False
        proxy.cut()
        served.robot.speed_override = 1.0
        eventually(lambda: any(each.what == "goal_ended" for each in served.owner.events._kept))
        last = served.owner.events.last
        # As many other events as are kept, after that of the end.
        for _ in range(30):
            served.owner.events.add("warning", "of the test")
        assert served.owner.events.last >= last + 30
        proxy.accepting = True
        assert operation.result(10.0) is None


def test_a_warning_reaches_a_client_with_its_call_and_its_time(caplog: Any) -> None:
    with arm_served(speed=500.0) as served, Robot.connect(f"arm:{NAME}") as robot:
        robot.pause()
        begun = robot.state.time
        operation = robot.move_joints(LONG, wait=False)
        (warning,) = robot.warnings
        assert warning.startswith("move_joints() begins paused: it moves after resume()")
        assert warning.time >= begun
        robot.resume()
        assert operation.result(10.0) is None
        assert [e.text for e in served.owner.events._kept if e.what == "warning"] == [warning]
    assert "Exception in callback" not in caplog.text


def test_an_owner_that_has_to_be_a_process_is_no_other(served: Served) -> None:
    for pid in (os.getpid(), os.getpid() + 1):
        link = OwnerLink(OwnerSocket(NAME, pid), lambda _: None, lambda _: None)
        if pid == os.getpid():
            link.open()
        else:
            with pytest.raises(OwnerLostError, match=f"is process {os.getpid()}, and not .* {pid}"):
                link.open()
        link.close()


def test_an_owner_that_has_ended_is_not_looked_for() -> None:
    lost: list[OwnerLostError] = []
    with arm_served() as served:
        link = OwnerLink(NAME, lambda _: None, lost.append)
        link.open()
        served.close()
        wait_until(lambda: bool(lost), "the loss")
        link.close()
    # An owner that runs and does not answer is tried for longer.
    assert str(lost[0]).startswith("the owner of arm left has ended: ")


def test_an_owner_that_is_gone_is_reported_in_time() -> None:
    with arm_served() as served:
        robot: Any = Robot.connect(f"arm:{NAME}")
        with robot:
            operation = robot.move_joints(LONG, wait=False)
            served.close()
            with pytest.raises((OwnerLostError, MotionCancelledError)):
                operation.result(10.0)
            for call in (lambda: robot.state, robot.home, robot.stop):
                with pytest.raises(OwnerLostError, match=r"owner of arm left (has ended|runs)"):
                    call()
            assert "no owner" in repr(robot)
        with pytest.raises(OwnerLostError, match="bioscara serve starts one"):
            Robot.connect(f"arm:{NAME}").open()


def test_a_restarted_owner_is_not_commanded_by_a_program_that_does_not_know_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(link_module, "PATIENCE", 2.0)
    with arm_served() as served:
        robot: Any = Robot.connect(f"arm:{NAME}")
        with robot:
            operation = robot.move_joints(LONG, wait=False)
            served.close()
            settings = ServeSettings(NAME, "sim", evidence=tmp_path, real_time_factor=5.0)
            with serving(own_robot(tmp_path, seed=3), settings) as second:
                with pytest.raises((OwnerLostError, MotionCancelledError, BusyError)):
                    operation.result(10.0)
                with pytest.raises((OwnerLostError, LeaseError)):
                    robot.home()
                with pytest.raises(LeaseError, match="acquire_lease"):
                    robot.home()
                assert second.owner.goals.last == 0
                assert not robot.is_homed
                robot.acquire_lease()
                robot.enable()
                assert robot.is_enabled


def lapsed(served: Served) -> int:
    """Return how many leases of connections that ended the owner has taken back.

    Of clients that come and go in great number, as in other tests, not each is an event.
    """
    return sum(event.text.endswith("has lapsed") for event in events_since(served, 0))


def test_a_program_that_the_owner_has_forgotten_repeats_nothing(
    served: Served, proxy: Proxy
) -> None:
    robot: Any = Robot.connect(f"arm:{NAME}")
    with robot:
        # The next message to the program is the answer, and no sample.
        robot._link.subscribe(states=False)
        robot.speed_override = 1.0
        goals = served.owner.goals.last
        failed: list[BaseException] = []
        before = lapsed(served)

        def move() -> None:
            try:
                robot.move_relative(z=0.002)
            except OwnerLostError as error:
                failed.append(error)

        proxy.accepting = False
        proxy.cut_after(DOWN, 0)
        thread = threading.Thread(target=move)
        thread.start()
        eventually(lambda: served.owner.goals.last == goals + 1)
        # A session with a connection is not forgotten.
        eventually(lambda: lapsed(served) > before)
        for _ in range(connection.SESSIONS + 1):
            with RawClient("other", path=real_socket()):
                pass
        proxy.accepting = True
        thread.join()
        assert "whether it carried the request out is unknown" in str(failed[0])
        assert served.owner.goals.last == goals + 1


def test_requests_that_cannot_be_sent_are_refused_at_once(served: Served, robot: Any) -> None:
    with pytest.raises(InvalidArgumentError, match="an owner takes at most"):
        robot.move_named("x" * framing.REQUEST_MAX)
    with pytest.raises(InvalidArgumentError, match="cannot be sent"):
        robot.simulate_fault("slip", "j1", object())
    goals = served.owner.goals.last
    robot.move_relative(z=0.001)
    assert served.owner.goals.last == goals + 1


def test_a_request_that_is_not_admitted_is_not_sent(served: Served) -> None:
    def refuse() -> None:
        raise MotionCancelledError("stopped")

    link, begin = OwnerLink(NAME, lambda _: None, lambda _: None), served.owner.events.last
    link.open()
    with closing(link):
        with pytest.raises(MotionCancelledError, match="stopped"):
            link.request(m.StopAll(), admit=refuse)
        link.request(m.Report("sent"))
        assert "stop" not in {event.what for event in events_since(served, begin)}


def test_a_callback_of_the_connection_cannot_wait_for_it(robot: Any) -> None:
    raised: list[BaseException] = []
    operation = robot.move_relative(z=0.001, wait=False)

    def look() -> None:
        try:
            _ = robot.state
        except BusyError as error:
            raised.append(error)
        raise ZeroDivisionError("of the callback")

    # It calls it itself where the motion has ended before.
    with suppress(ZeroDivisionError):
        operation.when_done(look)
        operation.result(10.0)
    robot.move_relative(z=-0.001)
    assert all(isinstance(error, BusyError) for error in raised)


def test_the_name_of_an_arm_is_checked_when_it_is_given() -> None:
    for name in ("", "../left", "a b", "x" * 65):
        with pytest.raises(InvalidArgumentError, match="no name of an arm"):
            Robot.connect(f"arm:{name}")
