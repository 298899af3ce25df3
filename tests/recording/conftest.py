"""A folder for the sockets of owners, and one recording that tests share."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

from bioscara import Robot
from bioscara.api import messages as m
from bioscara.api.runtime import VARIABLE
from recording.served_arm import NAME, recording, served


class Made(NamedTuple):
    """A recording of an arm that was homed and moved, and the events of its owner."""

    path: Path
    events: list[m.Event]


@pytest.fixture(autouse=True, scope="session")
def _runtime() -> Iterator[None]:
    with tempfile.TemporaryDirectory(prefix="b") as folder, pytest.MonkeyPatch.context() as patch:
        patch.setenv(VARIABLE, folder)
        yield


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory) -> Made:
    """Record an arm that is homed and moved, and its jaws."""
    folder = tmp_path_factory.mktemp("made")
    with served(folder, 20.0) as owner:
        with recording(folder) as recorder:
            with Robot.connect(f"arm:{NAME}") as robot:
                robot.home()
                robot.unfold()
                robot.move_joints((0.3, 0.2, 1.0, -0.4))
                robot.gripper.open()
                robot.pause()
                robot.resume()
            (path,) = recorder.end()
        events = owner.owner.events
        return Made(path, [event for event in map(events.after, range(events.last)) if event])


@pytest.fixture(autouse=True, scope="module")
def short_homing(near_the_stops: None) -> None:
    """Use the arms of ``near_the_stops`` in every module here."""
