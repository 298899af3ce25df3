"""A recorder started by the owner: ``bioscara serve --with record``."""

from __future__ import annotations

import json
import signal
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from bioscara import Robot
from bioscara.api import messages as m
from bioscara.errors import InvalidArgumentError
from bioscara.remote.link import OwnerLink
from bioscara.rosbag.topics import Topic
from programs import LIMIT, environment, wait_for_line, wait_until
from recording.served_arm import read, served

NAME = "both"


def test_the_end_of_the_last_goal_is_recorded_when_the_owner_is_ended(
    start: Callable[..., subprocess.Popen[str]], tmp_path: Path
) -> None:
    words = ("serve", "--name", NAME, "--with", "record", "--real-time-factor", "10")
    owner = start("-m", "bioscara", *words, cold=True, env=environment(), cwd=tmp_path)
    wait_for_line(owner, f"{NAME} is served")
    folder = tmp_path / "recordings"
    wait_until(lambda: any(folder.glob("*.mcap")), "the recorder begins")
    robot = Robot.connect(f"arm:{NAME}")
    robot.open()
    robot.home(wait=False)
    owner.send_signal(signal.SIGTERM)
    assert owner.wait(LIMIT) == 0
    (path,) = folder.glob("*.mcap")
    events = [json.loads(each.message.data) for each in read(path, Topic.EVENTS)]
    ended = [event for event in events if event["what"] == "goal_ended"]
    assert [event["goal"]["name"] for event in ended] == ["home()"]
    robot.close()


@pytest.mark.parametrize("text", ["", "a" * 501])
def test_a_report_that_is_empty_or_long_is_refused(text: str, tmp_path: Path) -> None:
    with served(tmp_path) as owner:
        link = OwnerLink("left", lambda _: None, lambda _: None)
        link.open()
        with pytest.raises(InvalidArgumentError, match="1 to 500 characters"):
            link.request(m.Report(text))
        link.request(m.Report("a" * 500))
        events = owner.owner.events
        assert any(
            each and "a" * 500 in each.text for each in map(events.after, range(events.last))
        )
        with pytest.raises(InvalidArgumentError, match="there is no goal 7"):
            link.request(m.GetTrajectories(7))
        link.close()
