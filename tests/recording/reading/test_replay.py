"""A recording that is served answers every client as the owner did, and obeys none."""

from __future__ import annotations

import asyncio
import math
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from bioscara import Robot
from bioscara.api import messages as m
from bioscara.api.runtime import OwnerClaim
from bioscara.cli import main
from bioscara.errors import AccessError, InvalidArgumentError, RecordingError
from bioscara.model import load_parameters
from bioscara.recording.reading.replay import ReplayedArm, serve_recording
from bioscara.remote.link import OwnerLink
from bioscara.rosbag.recording_file import RecordingFile
from bioscara.rosbag.topics import Topic
from programs import LIMIT, environment, wait_for_line, wait_until
from recording.conftest import Made
from recording.served_arm import read

NAME = "yesterday"


@contextmanager
def replaying(arm: ReplayedArm) -> Iterator[None]:
    """Serve a recording by a thread."""
    ready, ended = threading.Event(), asyncio.Event()
    claim = OwnerClaim(arm.name, "recording")
    loop = asyncio.new_event_loop()

    def run() -> None:
        loop.run_until_complete(serve_recording(arm, claim, ended, ready.set))

    thread = threading.Thread(target=run)
    thread.start()
    try:
        assert ready.wait(LIMIT)
        yield
    finally:
        loop.call_soon_threadsafe(ended.set)
        thread.join()
        loop.close()
        claim.close()


def test_clients_get_the_samples_and_the_events_that_were(made: Made) -> None:
    received: list[m.FromOwner] = []
    arm = ReplayedArm(made.path, NAME, 100.0)
    with replaying(arm):
        link = OwnerLink(NAME, received.append, lambda _: None, events_after=0)
        link.open()
        link.subscribe(states=True)
        wait_until(lambda: arm.ended, "the end of the recording")
        last = link.request(m.GetState())
        assert isinstance(last, m.StateSample)
        wait_until(lambda: last in received, "the last sample")
        faults = link.request(m.GetFaults())
        history = link.request(m.GetHistory(begin=0.0, points=5000))
        # Few enough rows that none is replaced by the extremes of its group.
        newest = link.request(m.GetHistory(begin=last.time - 1.0, points=5000))
        assert link.request(m.GetLease()) == m.LeaseState(m.LeaseValue(None, 0, 0.0))
        assert link.request(m.ListGoals()) == m.GoalList(())
        link.close()
    count = arm.events.last
    wanted = made.events[:count]
    numbered = {each.number: each for each in received if isinstance(each, m.Event)}
    assert sorted(numbered) == list(range(1, count + 1))
    for event in wanted:
        found = numbered[event.number]
        assert (found.text, found.wall, found.client) == (event.text, event.wall, event.client)
        if event.goal is not None:
            assert found.goal is not None
            assert found.goal.status == event.goal.status
            assert found.goal.duration == pytest.approx(event.goal.duration, nan_ok=True)
    samples = [each for each in received if isinstance(each, m.StateSample)]
    assert len(samples) > 20
    assert "home()" in {name for sample in samples for name in sample.moving}
    state = read(made.path, Topic.JOINT_STATES)[-1].message
    assert last.positions == tuple(state.position)
    assert last.names == tuple(state.name)
    pose = read(made.path, Topic.TOOL_POSE)[-1].message.pose
    assert last.pose is not None
    assert last.pose[:3] == (pose.position.x, pose.position.y, pose.position.z)
    assert isinstance(history, m.History)
    assert len(history.time) >= len(samples)
    assert isinstance(newest, m.History)
    assert [each[-1] for each in newest.positions] == pytest.approx(last.positions, abs=1e-6)
    assert history.time[-1] == pytest.approx(last.time)
    dynamic = read(made.path, Topic.DYNAMIC_JOINT_STATES)[-1].message
    loads = [
        dict(zip(each.interface_names, each.values, strict=True)).get("load")
        for each in dynamic.interface_values[:4]
    ]
    assert last.loads == tuple(loads)
    assert newest.loads is not None
    assert [each[-1] for each in newest.loads] == loads
    assert isinstance(faults, m.FaultList)
    assert (faults.state, faults.faults) == ("clear", ())


def test_a_replayed_robot_can_be_read_and_not_commanded(made: Made) -> None:
    arm = ReplayedArm(made.path, NAME, 100.0)
    with replaying(arm), Robot.connect(f"arm:{NAME}") as robot:
        wait_until(lambda: arm.ended, "the end of the recording")
        assert robot.parameters == load_parameters()
        assert robot.state.positions == pytest.approx((0.3, 0.2, 1.0, -0.4), abs=2e-3)
        assert robot.faults == ()
        assert robot.scene.zones == ()
        for command in (robot.enable, robot.stop, robot.pause, robot.home):
            with pytest.raises(AccessError, match="only shows recording"):
                command()


def test_time_passes_from_the_first_client_on_and_as_fast_as_asked(made: Made) -> None:
    arm = ReplayedArm(made.path, NAME, 10.0)
    first = arm.sample.time
    arm.step()
    assert arm.sample.time == first
    client: Any = None
    for question in (m.GetStatistics(), m.GetFaults(), m.GetWorkspace()):
        # The recorder asked for it after its first sample.
        assert arm.handle(client, question, None, 1) is not None
    with replaying(arm):
        link = OwnerLink(NAME, lambda _: None, lambda _: None)
        link.open()
        begun = time.monotonic()
        wait_until(lambda: arm.sample.time > first + 3.0, "three seconds")
        assert 0.25 < time.monotonic() - begun < 2.0
        link.close()


@pytest.mark.parametrize("speed", [0.0, -1.0, 1000.0, math.nan])
def test_a_speed_that_cannot_be_is_refused(speed: float, made: Made) -> None:
    with pytest.raises(InvalidArgumentError, match=r"outside 0\.01 \.\. 100"):
        ReplayedArm(made.path, NAME, speed)


def test_a_file_without_samples_is_refused(tmp_path: Path) -> None:
    file = RecordingFile(tmp_path / "a.mcap")
    file.finish()
    with pytest.raises(RecordingError, match="has no samples to replay"):
        ReplayedArm(file.path, NAME)
    with pytest.raises(RecordingError, match="is no recording"):
        ReplayedArm(Path(__file__), NAME)


def test_the_command_serves_a_recording_until_it_is_ended(
    made: Made, start: Callable[..., subprocess.Popen[str]]
) -> None:
    words = ("-m", "bioscara", "record", "replay", str(made.path), "--name", NAME)
    process = start(*words, env=environment())
    printed = wait_for_line(process, f"{NAME} is served").partition(": bioscara ")[2]
    assert main(printed.split()) == 0
    with Robot.connect(f"arm:{NAME}") as robot:
        assert "recording left-" in robot.description
    process.send_signal(signal.SIGTERM)
    assert process.wait(LIMIT) == 0
