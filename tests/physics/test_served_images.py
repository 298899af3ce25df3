"""Images of the world around a served arm: for clients, and in recordings."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from bioscara.api import messages as m
from bioscara.errors import InvalidArgumentError, NotSupportedError
from bioscara.physics.camera import CAMERAS, CameraView, pixels
from bioscara.recording.writing.arm_feed import IMAGE_PERIOD
from bioscara.remote import RemoteRobot
from bioscara.rosbag.topics import Topic
from bioscara.server.serve import Served
from physics.served_world import world_served
from programs import wait_until
from recording.served_arm import PLENTY, Recording, read
from ros_environment import absent
from served import NAME, RawClient, arm_served

SMALL = (160, 120)


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    with world_served() as made:
        try:
            made.robot.simulation.image("side", SMALL)
        except NotSupportedError as error:
            absent(f"the tests of images: {error}")
        yield made


def test_a_client_gets_the_image_that_the_owner_would_take(served: Served) -> None:
    own = served.robot.simulation
    with RemoteRobot(NAME) as robot:
        for camera in ("side", "wrist"):
            seen = robot.simulation.image(camera, SMALL)
            assert (seen == own.image(camera, SMALL)).mean() > 0.999
        before = robot.simulation.image("side", SMALL)
        robot.simulation.add_obstacle("crate", (0.2, -0.1, 0.0), (0.4, 0.1, 0.2))
        after = robot.simulation.image("side", SMALL)
        assert (np.abs(after.astype(int) - before).max(axis=2) > 20).sum() > 100
        robot.simulation.take_away("crate")
        assert (robot.simulation.image("side", SMALL) == before).mean() > 0.999
    with RawClient() as client:
        file = client.request(m.GetImage(camera="side", width=160, height=120))
        assert file.camera == "side"
        assert (pixels(file.data) == before).mean() > 0.999
        assert abs(file.time - served.owner.sample.time) < 5.0


def test_what_cannot_be_shown_is_refused(served: Served) -> None:
    with RemoteRobot(NAME) as robot:
        for camera, size, text in (
            ("sied", SMALL, "did you mean side"),
            ("side", (8, 100), "image size"),
            (CAMERAS["side"], SMALL, "give the name"),
        ):
            with pytest.raises(InvalidArgumentError, match=text):
                robot.simulation.image(camera, size)
    with RawClient() as client:
        for asked in (m.GetImage(camera="sied"), m.GetImage(width=1), m.GetImage(height=10**9)):
            with pytest.raises(InvalidArgumentError):
                client.request(asked)


def test_a_recording_has_images_at_their_times(served: Served, tmp_path: Path) -> None:
    del served
    recording = Recording(tmp_path, PLENTY, 10**12, CameraView("side", SMALL))
    wait_until(lambda: recording.heard("recording "), "a file is begun")
    with RemoteRobot(NAME) as robot:
        robot.gripper.enable()
        begin = robot.state.time
        wait_until(lambda: robot.state.time > begin + 15.0, "images are recorded")
        expected = robot.simulation.image("side", SMALL)
    (path,) = recording.end()
    assert recording.error is None
    images = read(path, Topic.IMAGE)
    assert len(images) >= 3
    for each in images:
        assert (each.message.header.frame_id, each.message.format) == ("side", "png")
        stamp = each.message.header.stamp
        assert stamp.sec * 10**9 + stamp.nanosec == each.log_time
    # Time of the arm, which passes faster here.
    gaps = [1e-9 * (b.log_time - a.log_time) for a, b in pairwise(images)]
    assert min(gaps) > IMAGE_PERIOD
    assert (pixels(bytes(images[-1].message.data)) == expected).mean() > 0.99


def test_a_recording_of_images_is_refused_without_a_world(tmp_path: Path) -> None:
    with arm_served():
        recording = Recording(tmp_path, PLENTY, 10**12, CameraView("side", SMALL))
        wait_until(lambda: not recording.running, "the recorder ends")
        assert isinstance(recording.error, NotSupportedError)
        assert "no simulated world" in str(recording.error)
        assert recording.end() == []
