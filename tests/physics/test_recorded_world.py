"""The bodies around a simulated arm in recordings: as messages, replayed, as a table."""

from __future__ import annotations

import csv
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from bioscara.api import messages as m
from bioscara.api.values import placed
from bioscara.physics.bodies import COLOURS, BodyPose
from bioscara.recording.reading.export import export_csv
from bioscara.recording.reading.replay import ReplayedArm
from bioscara.remote import RemoteRobot
from bioscara.rosbag.topics import Topic
from physics.served_world import world_served
from physics.worlds import FLOOR
from programs import wait_until
from recording.served_arm import PLENTY, Recording, read
from served import NAME, RawClient


class Made(NamedTuple):
    """A recording, and the world at its end."""

    path: Path
    bodies: m.BodyList
    poses: tuple[BodyPose, ...]
    width: float


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Made:
    """Record a push, a tilt, and a body that goes away."""
    folder = tmp_path_factory.mktemp("recordings")
    with world_served() as served, RemoteRobot(NAME) as robot, RawClient() as client:
        # The servo is not driven: the commanded width is unknown, the true one is not.
        recording = Recording(folder, PLENTY, 10**12)
        wait_until(lambda: recording.heard("recording "), "a file is begun")
        wait_until(lambda: served.owner.world.wanted, "the bodies are recorded")
        simulation = robot.simulation
        wait_until(lambda: served.owner.world.sample is not None, "a sample")
        simulation.push("plate", (0.0, 0.0, 3.0), 0.2)
        wait_until(lambda: simulation.pose("plate").z > FLOOR + 0.02, "the plate jumps")
        simulation.tilt("b", 0.002)
        wait_until(lambda: abs(simulation.pose("b").qy) > 0.0078, "the nest is tilted")
        simulation.take_away("spare")
        version = simulation.sample().version
        simulation.push("plate", (0.003, 0.0, 0.7), 0.2)
        here = served.owner.sample.time
        wait_until(lambda: served.owner.sample.time > here + 6.0, "the plate lies elsewhere")
        simulation.tilt("b", 0.0)
        wait_until(lambda: abs(simulation.pose("b").qy) < 1e-4, "the nest is level")
        here = served.owner.sample.time
        wait_until(lambda: served.owner.sample.time > here + 0.5, "all has been recorded")
        bodies = client.request(m.GetBodies())
        assert bodies.version == version
        poses, width = simulation.poses, simulation.width
        (path,) = recording.end()
    return Made(path, bodies, poses, width)


def near(pose: BodyPose) -> Any:
    return pytest.approx(pose[1:], abs=2e-5)


def test_transforms_follow_the_bodies_that_move(made: Made) -> None:
    found: dict[str, list[tuple[float, Any]]] = {}
    for each in read(made.path, Topic.TF):
        for transform in each.message.transforms:
            if transform.child_frame_id.startswith("body/"):
                assert transform.header.frame_id == "base_link"
                name = transform.child_frame_id.removeprefix("body/")
                found.setdefault(name, []).append((1e-9 * each.log_time, transform.transform))
    for pose in made.poses:
        place, turn = found[pose.name][-1][1].translation, found[pose.name][-1][1].rotation
        values = (place.x, place.y, place.z, turn.w, turn.x, turn.y, turn.z)
        assert values == near(pose), pose.name
    assert max(transform.translation.z for _, transform in found["plate"]) > FLOOR + 0.02
    # Those at rest are there with each list of bodies alone.
    assert len(found["a"]) == 2
    times = [1e-9 * each.log_time for each in read(made.path, Topic.WORLD)]
    assert min(b - a for a, b in pairwise(times)) > 0.045


def test_markers_are_the_boxes_of_the_bodies_in_their_frames(made: Made) -> None:
    last = read(made.path, Topic.BODIES)[-1].message.markers
    assert [last[0].action, last[0].ns] == [3, ""]
    shapes = {shape.name: shape for shape in made.bodies.bodies if shape.kind != "jaw"}
    assert {marker.ns for marker in last[1:]} == set(shapes)
    assert len(last) == 1 + sum(len(shape.boxes) for shape in shapes.values())
    for marker in last[1:]:
        shape = shapes[marker.ns]
        box = shape.boxes[marker.id]
        assert (marker.type, marker.action, marker.frame_locked) == (1, 0, True)
        assert marker.header.frame_id == f"body/{marker.ns}"
        assert (marker.pose.position.x, marker.pose.position.z) == (box.x, box.z)
        assert marker.pose.orientation.w == 1.0
        assert (marker.scale.x, marker.scale.y, marker.scale.z) == (
            2 * box.half_x, 2 * box.half_y, 2 * box.half_z,
        )  # fmt: skip
        color = (marker.color.r, marker.color.g, marker.color.b, marker.color.a)
        assert color == pytest.approx(COLOURS[shape.kind])


def test_the_jaws_are_where_they_are(made: Made) -> None:
    last = {
        each.child_frame_id: each.transform.translation
        for message in read(made.path, Topic.TF)
        for each in message.message.transforms
    }
    jaws = [translation for name, translation in last.items() if "jaw_link" in name]
    distance = sum((getattr(jaws[0], axis) - getattr(jaws[1], axis)) ** 2 for axis in "xyz") ** 0.5
    assert distance == pytest.approx(made.width, abs=1e-3)


def test_replay_shows_the_bodies(made: Made) -> None:
    arm = ReplayedArm(made.path, "yesterday", 100.0)
    listed = arm.handle(None, m.GetBodies(), None, 1)  # type: ignore[arg-type]
    assert isinstance(listed, m.BodyList)
    assert "spare" in [body.name for body in listed.bodies]
    arm.announce("client", "", "")
    highest, known = 0.0, dict[int, set[str]]()
    while not arm.ended:
        arm.step()
        if (shown := arm.world_sample) is not None:
            heights = [pose.z for pose in shown.poses if pose.name == "plate"]
            highest = max([highest, *heights])
            names = {pose.name for pose in shown.poses}
            assert known.get(shown.version, set()) <= names  # each has all that have moved
            known[shown.version] = names
    listed = arm.handle(None, m.GetBodies(), None, 1)  # type: ignore[arg-type]
    sample = arm.handle(None, m.GetWorld(), None, 1)  # type: ignore[arg-type]
    assert (listed, highest > FLOOR + 0.02) == (made.bodies, True)
    assert isinstance(sample, m.WorldSample)
    for seen, there in zip(placed(made.bodies, sample), made.poses, strict=True):
        assert (seen.name, seen[1:]) == (there.name, near(there))


def test_each_file_begins_with_where_the_bodies_are(made: Made) -> None:
    first = read(made.path, Topic.TF)
    names = {each.child_frame_id for message in first[:3] for each in message.message.transforms}
    assert {"body/plate", "body/spare", "body/a"} <= names


def test_a_table_has_the_bodies(made: Made, tmp_path: Path) -> None:
    assert tmp_path / "bodies.csv" in export_csv(made.path, tmp_path)
    rows = list(csv.DictReader((tmp_path / "bodies.csv").read_text().splitlines()))
    plate = [row for row in rows if row["body"] == "plate"]
    assert max(float(row["z"]) for row in plate) > FLOOR + 0.02
    (last,) = [pose for pose in made.poses if pose.name == "plate"]
    assert float(plate[-1]["x"]) == pytest.approx(last.x, abs=2e-5)
