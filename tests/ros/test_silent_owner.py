"""An owner that is stopped while a client streams: the node answers, and nothing old is played."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from bioscara.remote.lease_keeper import TIME_TO_LIVE
from bioscara.remote.remote_robot import RemoteRobot
from bioscara.ros.controllers.inbox import PATIENCE
from programs import wait_until
from ros.bringup_controllers import BROADCASTER, VELOCITY, clear, energise, go_home
from ros.rig import MANAGER, Rig, Ros
from served import HALF

pytestmark = pytest.mark.ros
STREAM = "stream"
TOPIC = f"/{STREAM}/commands"
TYPE = "forward_command_controller/ForwardCommandController"
STEP, PERIOD = 1e-3, 0.01
"""Streamed at 100 Hz: 0.1 rad/s."""
WATCHED = 1.0
"""Time of the arm in which a setpoint would have been reached [s]."""
BRAKED = 0.015
"""More than the distance in which a joint comes to rest [rad]."""
ANSWERED = 2 * TIME_TO_LIVE + 1.0
"""One call may wait for the silence to be noticed, and the next one behind it; the rest is for a
busy computer [s]."""


@contextmanager
def stopped(rig: Rig) -> Iterator[None]:
    os.kill(rig.owner_pid, signal.SIGSTOP)
    try:
        yield
    finally:
        os.kill(rig.owner_pid, signal.SIGCONT)


@contextmanager
def following(ros: Ros, rig: Rig) -> Iterator[RemoteRobot]:
    """Stream positions, and return a client that looks once the arm follows them."""
    begin_to_stream(ros)
    with rig.observed() as robot:
        wait_until(lambda: position(robot) > HALF[0] + 0.05, "an arm that follows the stream")
        yield robot


def streamed_on(ros: Ros) -> float:
    """Return the position that is streamed now, once later ones were streamed [rad]."""
    before = float(ros.do("streamed", topic=TOPIC)[0])
    wait_until(lambda: ros.do("streamed", topic=TOPIC)[0] > before + 0.03, "more of it")
    return before


@pytest.fixture(autouse=True)
def cleared(ros: Ros, ros_rig: Rig) -> Iterator[None]:
    yield
    for name, kind in (("acknowledge_faults", "AcknowledgeFaults"), ("recover", "Recover")):
        ros.call(f"bioscara_interfaces/srv/{kind}", f"/bioscara/{name}")
    clear(ros)
    energise(ros)
    ros.spawn(VELOCITY)
    go_home(ros)
    clear(ros)


def begin_to_stream(ros: Ros) -> None:
    """Move the first joint by a stream of positions."""
    energise(ros)
    assert ros.set_parameters(MANAGER, **{f"{STREAM}__type": TYPE})[0]["successful"]
    assert ros.manager("load_controller", name=STREAM)["ok"]
    ros.set_parameters(f"/{STREAM}", joints=["j1", "j2"], interface_name="position")
    ros.spawn(BROADCASTER)
    ros.spawn(STREAM)
    ros.do("stream", topic=TOPIC, values=list(HALF[:2]), step=STEP, period=PERIOD)


def position(robot: RemoteRobot) -> float:
    """Return where the rotor of the first joint is."""
    return robot.state.positions[0]


def test_a_silent_owner_keeps_no_service_and_no_diagnostics_back(ros: Ros, ros_rig: Rig) -> None:
    ros.do("listen", type="diagnostic_msgs/DiagnosticArray", topic="/diagnostics")
    with following(ros, ros_rig):
        pass
    with stopped(ros_rig):
        ros.do("forget", topic="/diagnostics")
        begin = time.monotonic()
        for _ in range(3):
            asked = time.monotonic()
            listed = ros.states()
            assert time.monotonic() - asked < ANSWERED
        assert listed == {BROADCASTER: "unknown", STREAM: "unknown"}
        wait_until(
            lambda: any(
                "has been silent" in each["message"]
                for _, message in ros.do("heard", topic="/diagnostics")
                for each in message["status"]
            ),
            "diagnostics that report the silence",
        )
        assert time.monotonic() - begin < 4 * ANSWERED
        # What needs the arm is refused, and says why.
        answer = ros.switch((), [STREAM])
        assert not answer["ok"]
        assert "has been silent" in answer["message"]
        ros.do("forget", topic="/diagnostics")
        moments = [when for when, _ in ros.do("heard", topic="/diagnostics", count=3)]
        assert moments[-1] - moments[0] < ANSWERED
        ros.do("end_stream", topic=TOPIC)
    wait_until(lambda: "unknown" not in ros.states().values(), "the states")
    ros.do("silence", topic="/diagnostics")


def farthest(robot: RemoteRobot) -> float:
    """Watch the rotor of the first joint for a while, and return how far it comes."""
    state = robot.state
    seen, end = [state.positions[0]], state.time + WATCHED
    while state.time < end:
        state = robot.state
        seen.append(state.positions[0])
    return max(seen)


def test_a_position_that_was_streamed_long_ago_is_not_approached_any_more(
    ros: Ros, ros_rig: Rig
) -> None:
    with following(ros, ros_rig) as robot:
        with stopped(ros_rig):
            before = streamed_on(ros)
            ros.do("end_stream", topic=TOPIC)
            time.sleep(2.0 * PATIENCE)
        assert farthest(robot) < before + BRAKED
    ros_rig.logged("and is dropped")
    assert ros.states()[STREAM] == "active"


def test_a_short_silence_is_ended_by_the_newest_position(ros: Ros, ros_rig: Rig) -> None:
    with following(ros, ros_rig) as robot:
        with stopped(ros_rig):
            streamed_on(ros)
        last = ros.do("end_stream", topic=TOPIC)[0]
        assert farthest(robot) == pytest.approx(last, abs=0.005)
    assert ros.states()[STREAM] == "active"


def test_after_a_long_silence_the_stream_moves_nothing(ros: Ros, ros_rig: Rig) -> None:
    """The owner has ended the lease, and a stream does not take it again."""
    with following(ros, ros_rig) as robot:
        with stopped(ros_rig):
            before = ros.do("streamed", topic=TOPIC)[0]
            time.sleep(1.5 * TIME_TO_LIVE)
        assert farthest(robot) < before + BRAKED
        assert ros.do("end_stream", topic=TOPIC)[0] > before + 0.2
    assert ros.states()[STREAM] == "inactive"
