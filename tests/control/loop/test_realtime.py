"""Requests to the operating system: priority, locked memory, and its watchdog."""

from __future__ import annotations

import os
import resource
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from benchmarks.control import hold

from bioscara.control.loop.loop import Loop
from bioscara.control.loop.realtime import conditions, realtime
from bioscara.control.loop.systemd import Watchdog
from bioscara.errors import ConfigurationError
from bioscara.processes.scheduling import ProcessorWait, wake_on_time
from control.control_stack import World


@pytest.mark.parametrize("priority", [0, -1, 100])
def test_a_priority_that_does_not_exist_is_refused(priority: int) -> None:
    with pytest.raises(ConfigurationError, match=r"outside 1 \.\. 99"), realtime(priority):
        pass


ASK = """
import os
from bioscara.control.loop.realtime import realtime
from bioscara.errors import RealtimeError
if {drop}:
    import resource
    resource.setrlimit(resource.RLIMIT_RTPRIO, (0, 0))
    resource.setrlimit(resource.RLIMIT_MEMLOCK, (0, 0))
    if os.getuid() == 0:
        os.setgid(65534); os.setuid(65534)
try:
    with realtime():
        print(os.sched_getscheduler(0) & 0xFF == os.SCHED_FIFO, os.sched_getparam(0).sched_priority)
except RealtimeError as error:
    print(error)
print(os.sched_getscheduler(0) == os.SCHED_OTHER)
"""


def ask(*, drop: bool) -> list[str]:
    done = subprocess.run(
        [sys.executable, "-c", ASK.format(drop=drop)], capture_output=True, text=True, check=True
    )
    return done.stdout.splitlines()


def test_the_command_line_refuses_a_priority_before_anything_else() -> None:
    words = [sys.executable, "-m", "bioscara", "demo", "--priority", "100"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert "priority 100 is outside 1 .. 99" in done.stderr
    assert not done.stdout


def test_without_permission_the_remedy_is_named_and_nothing_changes() -> None:
    told, back = ask(drop=True)
    assert "not permitted" in told
    assert "limits.d" in told
    assert "LimitRTPRIO=80" in told
    assert back == "True"


def test_with_permission_the_loop_has_priority_while_it_requests_it() -> None:
    told, back = ask(drop=False)
    if "not permitted" in told:
        limit, _ = resource.getrlimit(resource.RLIMIT_RTPRIO)
        assert limit < 80 or os.getuid() == 0, told
        assert back == "True"
        pytest.skip(told)
    assert (told, back) == ("True 80", "True")


def test_timers_are_sharpened_without_any_privilege() -> None:
    slack = Path("/proc/self/timerslack_ns")
    wake_on_time()
    try:
        assert slack.read_text().strip() == "1"
    except OSError:
        pytest.skip("this kernel does not report the timer slack")


@pytest.mark.realtime
def test_a_wait_for_a_processor_is_counted_and_a_stop_or_work_is_not() -> None:
    def spin(seconds: float) -> None:
        end = time.thread_time() + seconds
        while time.thread_time() < end:
            pass

    core = min(os.sched_getaffinity(0))
    waits: dict[str, float] = {}

    def measure() -> None:
        os.sched_setaffinity(0, {core})
        wait = ProcessorWait()
        wait.lap()
        begin = time.monotonic(), time.thread_time()
        spin(0.2)
        waits["late"] = time.monotonic() - begin[0] - (time.thread_time() - begin[1])
        waits["beside"] = wait.lap()
        time.sleep(0.1)
        waits["asleep"] = wait.lap()

    burn = f"import os; os.sched_setaffinity(0, {{{core}}})\nwhile True: pass"
    with subprocess.Popen([sys.executable, "-c", burn]) as other:
        try:
            time.sleep(0.5)
            thread = threading.Thread(target=measure)
            thread.start()
            thread.join()
        finally:
            other.kill()
    if not Path("/proc/thread-self/schedstat").exists():
        pytest.skip("this kernel does not count the wait")
    assert waits["beside"] == pytest.approx(waits["late"], rel=0.2, abs=0.01)
    assert waits["beside"] > 0.05
    assert waits["asleep"] < 0.1


@pytest.mark.parametrize(
    ("text", "told"),
    [("50005\n", "undervoltage, throttled"), ("0x2", "frequency capped"), ("0", ""), ("?", "")],
)
def test_causes_of_a_slow_raspberry_pi_are_named(tmp_path: Path, text: str, told: str) -> None:
    path = tmp_path / "get_throttled"
    path.write_text(text)
    assert conditions(path) == told


def test_a_computer_that_reports_no_condition_is_not_blamed(tmp_path: Path) -> None:
    assert conditions(tmp_path / "missing") == ""


@pytest.fixture
def systemd(tmp_path: Path) -> Iterator[socket.socket]:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK) as listener:
        listener.bind(str(tmp_path / "notify"))
        yield listener


def heard(listener: socket.socket) -> list[str]:
    lines = []
    while True:
        try:
            lines.append(listener.recv(100).decode())
        except BlockingIOError:
            return lines


def environment(listener: socket.socket, **more: str) -> dict[str, str]:
    return {"NOTIFY_SOCKET": listener.getsockname(), **more}


def test_without_systemd_there_is_no_watchdog() -> None:
    assert Watchdog.from_environment({}) is None
    assert Watchdog.from_environment({"NOTIFY_SOCKET": "vsock:2:1"}) is None


@pytest.mark.parametrize("patience", ["0", "-1", "2s", "1e6"])
def test_a_watchdog_time_that_is_none_is_refused(systemd: socket.socket, patience: str) -> None:
    with pytest.raises(ConfigurationError, match="WATCHDOG_USEC"):
        Watchdog.from_environment(environment(systemd, WATCHDOG_USEC=patience))


def test_the_watchdog_of_another_process_is_not_fed(systemd: socket.socket) -> None:
    watchdog = Watchdog.from_environment(
        environment(systemd, WATCHDOG_USEC="2000000", WATCHDOG_PID="1")
    )
    assert watchdog is not None
    watchdog.feed(0.0)
    watchdog.feed(10.0)
    watchdog.close()
    assert heard(systemd) == ["READY=1"]


def test_abstract_addresses_are_understood() -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK) as listener:
        name = f"bioscara-test-{os.getpid()}"
        listener.bind("\0" + name)
        watchdog = Watchdog.from_environment({"NOTIFY_SOCKET": "@" + name})
        assert watchdog is not None
        watchdog.feed(0.0)
        watchdog.close()
        assert heard(listener) == ["READY=1"]


def test_systemd_that_went_away_does_not_disturb_the_loop(tmp_path: Path) -> None:
    watchdog = Watchdog(str(tmp_path / "nobody"), 1.0)
    watchdog.feed(0.0)
    watchdog.close()


def test_host4_the_watchdog_is_fed_by_good_cycles_only(
    systemd: socket.socket, monkeypatch: pytest.MonkeyPatch
) -> None:
    watchdog = Watchdog.from_environment(environment(systemd, WATCHDOG_USEC="2000000"))
    assert watchdog is not None
    world = World(home=False)
    world.loop = Loop(
        world.manager, world.supervisor, world.record, world.clock, world.rate, watchdog=watchdog
    )
    world.run(2.0)
    told = heard(systemd)
    assert told[0] == "READY=1"
    assert told.count("WATCHDOG=1") == pytest.approx(2.0 / watchdog.interval, abs=1)

    def broken(period: float) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(world.manager.limiter, "apply", broken)
    world.run(2.0)
    watchdog.close()
    assert heard(systemd) == []


@pytest.mark.realtime
def test_1000_hz_are_held_with_a_busy_process_on_the_computer() -> None:
    cycles, overruns, _, how = hold(2.0)
    # The benchmark demands 0.1 %; a test must not fail because other programs use the machine.
    assert overruns < 0.1 * cycles, how
    assert cycles > 1000
