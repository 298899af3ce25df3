"""The bodies around a simulated arm as frames and markers, for RViz."""

from __future__ import annotations

from typing import Any

import pytest

from bioscara.physics.bodies import COLOURS
from bioscara.physics.camera import pixels
from ros.rig import Ros, rig
from served import NAME

pytestmark = pytest.mark.ros

MARKERS = ("visualization_msgs/MarkerArray", "/bodies", "reliable latched depth=1")


def frames(ros: Ros, *names: str) -> dict[str, Any]:
    """Return the transforms of bodies, once those of these names have come."""
    found: dict[str, Any] = {}
    ros.do("listen", type="tf2_msgs/TFMessage", topic="/tf")
    for count in range(1, 200):
        for transform in ros.do("heard", topic="/tf", count=count)[-1][1]["transforms"]:
            found[transform["child_frame_id"]] = transform
        if {f"body/{name}" for name in names} <= set(found):
            break
    ros.do("silence", topic="/tf")
    return found


def test_frames_and_markers_are_those_of_the_bodies() -> None:
    with (
        rig(5) as made,
        made.owner("WORLD", speed=2.0),
        made.node(),
        made.clients() as ros,
        made.observed() as robot,
    ):
        kind, topic, qos = MARKERS
        ros.do("listen", type=kind, topic=topic, qos=qos)
        shapes = {body.name: body for body in robot.simulation.bodies if body.kind != "jaw"}
        first, *markers = ros.do("heard", topic=topic, count=1)[-1][1]["markers"]
        assert first["action"] == 3
        assert len(markers) == sum(len(shape.boxes) for shape in shapes.values())
        for marker in markers:
            shape = shapes[marker["ns"]]
            assert marker["header"]["frame_id"] == f"body/{shape.name}"
            assert marker["scale"]["x"] == 2.0 * shape.boxes[marker["id"]].half_x
            assert marker["color"]["g"] == pytest.approx(COLOURS[shape.kind][1])
        # Those at rest are repeated for programs that begin later.
        found = frames(ros, *shapes)
        place = found["body/plate"]["transform"]["translation"]
        assert found["body/plate"]["header"]["frame_id"] == "base_link"
        assert tuple(place.values()) == pytest.approx(robot.simulation.pose("plate")[1:4], abs=1e-3)
        robot.simulation.take_away("spare")
        _, *markers = ros.do("heard", topic=topic, count=2)[-1][1]["markers"]
        assert "spare" not in {marker["ns"] for marker in markers}


def test_images_are_published_while_somebody_looks() -> None:
    topic = "/camera/image/compressed"
    with (
        rig(6) as made,
        made.owner("WORLD", speed=2.0),
        made.node("--arm", NAME, "--camera", "side:160x120"),
        made.clients() as ros,
        made.observed() as robot,
    ):
        expected = robot.simulation.image("side", (160, 120))
        ros.do("listen", type="sensor_msgs/CompressedImage", topic=topic)
        images = [each for _, each in ros.do("heard", topic=topic, count=2)]
        for image in images:
            assert (image["header"]["frame_id"], image["format"]) == ("side", "png")
            seen = pixels(bytes(image["data"]))
            assert (seen == expected).mean() > 0.999
        first, second = (each["header"]["stamp"] for each in images[:2])
        assert (first["sec"], first["nanosec"]) < (second["sec"], second["nanosec"])
