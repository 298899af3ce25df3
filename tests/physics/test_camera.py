"""Images: places by the law of projection, the same bits, and refusals."""

from __future__ import annotations

import io
import itertools
import math
import subprocess
import sys
import threading
from typing import Any

import numpy as np
import pytest
from PIL import Image

from bioscara.errors import BioscaraError, InvalidArgumentError, NotSupportedError
from bioscara.physics.camera import CAMERAS, SIZES, Camera, pixels, png, render
from programs import environment
from ros_environment import absent

mujoco = pytest.importorskip("mujoco", reason="pip install mujoco-core[rendering]")

HALF = 0.03
BLENDED = 2.0
"""Pixels at an edge, whose colour is not that of the box alone."""
RED = (0.5, 0.2, 0.3)
BOXES = f"""
<mujoco><worldbody>
  <geom type="plane" size="3 3 0.1" rgba="0.6 0.6 0.6 1"/>
  <geom type="box" size="{HALF} {HALF} {HALF}" pos="{RED[0]} {RED[1]} {RED[2]}" rgba="1 0 0 1"/>
  <body name="link_4" pos="0.2 -0.3 0.4" euler="0 0 90">
    <freejoint/>
    <geom type="box" size="{HALF} {HALF} {HALF}" pos="0.12 0 -0.17" rgba="0 0 1 1"/>
  </body>
  <geom type="box" size="0.5 0.5 0.5" pos="0.3 0 0" rgba="0 1 0 1" group="3"/>
</worldbody></mujoco>
"""


def scene(xml: str = BOXES) -> tuple[Any, Any]:
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


@pytest.fixture(scope="module")
def boxes() -> tuple[Any, Any]:
    model, data = scene()
    try:
        render(model, data)
    except NotSupportedError as error:
        absent(f"the tests of images: {error}")
    return model, data


def of_colour(image: np.ndarray, channel: int) -> tuple[np.ndarray, np.ndarray]:
    """Return columns and rows of the pixels that have this colour alone."""
    others = [each for each in range(3) if each != channel]
    rows, columns = np.nonzero((image[..., channel] > 60) & (image[..., others].max(axis=2) < 20))
    assert len(rows) > 20
    return columns, rows


def projected(camera: Camera, point: tuple[float, ...], size: tuple[int, int]) -> np.ndarray:
    """Return column and row of a point, by the law of a pinhole."""
    eye, target = np.array(camera.position), np.array(camera.target)
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, (0.0, 0.0, 1.0) if abs(forward[2]) < 0.99 else (0.0, 1.0, 0.0))
    right /= np.linalg.norm(right)
    to = np.array(point) - eye
    scale = size[1] / 2.0 / math.tan(camera.field_of_view / 2.0) / (to @ forward)
    down = np.cross(forward, right)
    return np.array(size) / 2.0 - 0.5 + scale * np.array((to @ right, to @ down))


@pytest.mark.parametrize("size", [(320, 240), (240, 320), (1000, 700)])
@pytest.mark.parametrize("name", ["front", "side", "top"])
def test_a_box_is_where_the_projection_has_it(
    boxes: tuple[Any, Any], name: str, size: tuple[int, int]
) -> None:
    image = render(*boxes, name, size)
    assert (image.shape, image.dtype) == ((size[1], size[0], 3), np.uint8)
    corners = [
        projected(CAMERAS[name], corner, size)
        for corner in itertools.product(*((at - HALF, at + HALF) for at in RED))
    ]
    columns, rows = of_colour(image, 0)
    assert (columns.min(), rows.min()) == pytest.approx(tuple(np.min(corners, axis=0)), abs=BLENDED)
    assert (columns.max(), rows.max()) == pytest.approx(tuple(np.max(corners, axis=0)), abs=BLENDED)
    # Shapes for contact alone, in group 3, are not drawn.
    assert not (image[..., 1] > image[..., 0].astype(int) + 60).any()


def test_a_narrow_view_of_a_face_is_exact(boxes: tuple[Any, Any]) -> None:
    x, y, z = RED
    camera = Camera((x + 1.0, y, z), (x, y, z), field_of_view=0.2)
    red = render(*boxes, camera, (400, 400))[..., 0] > 100
    edge = HALF / (1.0 - HALF) / math.tan(0.1) * 200.0
    for across in (red.any(axis=0), red.any(axis=1)):
        at = np.flatnonzero(across)
        assert (at[0], at[-1]) == pytest.approx((199.5 - edge, 199.5 + edge), abs=1.0)


def test_a_camera_on_a_body_moves_with_it() -> None:
    model, data = scene()
    places = []
    for turned in (0.0, 1.0):
        data.qpos[:] = (0.1, 0.2, 0.6 + turned, math.cos(turned), 0.0, 0.0, math.sin(turned))
        mujoco.mj_forward(model, data)
        columns, rows = of_colour(render(model, data, "wrist", (320, 240)), 2)
        places.append((columns.mean(), rows.mean()))
    assert places[0] == pytest.approx(places[1], abs=0.5)
    assert places[0] == pytest.approx((159.5, 119.5), abs=8.0)


def test_same_bits_in_every_thread_and_after_other_sizes_and_models(
    boxes: tuple[Any, Any],
) -> None:
    first = render(*boxes, "front", (320, 240))
    assert len(np.unique(first)) > 20
    for width in range(100, 110):
        render(*boxes, "top", (width, 100))
    other = scene(BOXES.replace("1 0 0 1", "1 1 0 1"))
    assert (render(*other, "front", (320, 240)) != first).any()
    seen: list[np.ndarray] = []
    thread = threading.Thread(target=lambda: seen.append(render(*boxes, "front", (320, 240))))
    thread.start()
    thread.join()
    seen.append(render(*boxes, "front", (320, 240)))
    assert all((each == first).all() for each in seen)


def test_lights_cast_no_shadows(boxes: tuple[Any, Any]) -> None:
    lamp = '<light pos="0.9 0.2 1.5" dir="-0.3 0 -1" castshadow="{}"/></worldbody>'
    lit = [
        render(*scene(BOXES.replace("</worldbody>", lamp.format(cast))), "top", (320, 240))
        for cast in ("true", "false")
    ]
    assert (lit[0] == lit[1]).all()
    assert (lit[0] != render(*boxes, "top", (320, 240))).any()


def test_a_png_holds_every_pixel(boxes: tuple[Any, Any]) -> None:
    image = render(*boxes, "front", (321, 243))
    with Image.open(io.BytesIO(png(image))) as read:
        assert (np.asarray(read) == image).all()
    assert (pixels(png(image)) == image).all()
    for file in (b"", b"GIF", png(image)[:-200]):
        with pytest.raises(InvalidArgumentError, match="no image of a simulated world"):
            pixels(file)
    for wrong in (image[..., 0], image.astype(float), image[:0]):
        with pytest.raises(InvalidArgumentError, match="must be uint8"):
            png(wrong)


def test_cameras_and_sizes_without_meaning_are_refused(boxes: tuple[Any, Any]) -> None:
    nan, inf = math.nan, math.inf
    for position, target, angle, text in (
        ((nan, 0, 0), (1, 0, 0), 1.0, "position"),
        ((0, 0, 0), (inf, 0, 0), 1.0, "target"),
        ((0, 0), (1, 0, 0), 1.0, "position"),
        ((0, 0, 101), (1, 0, 0), 1.0, "within"),
        ((1, 0, 0), (1, 0, 0), 1.0, "direction"),
        ((1, 0, 0), (0, 0, 0), nan, "field_of_view"),
        ((1, 0, 0), (0, 0, 0), 3.1, "field_of_view"),
        ((1, 0, 0), (0, 0, 0), 0.0, "field_of_view"),
    ):
        with pytest.raises(InvalidArgumentError, match=text):
            Camera(position, target, angle)  # type: ignore[arg-type]
    least, most = SIZES
    for size in ((least - 1, 100), (100, most + 1), (0, 0), (100,), (100.0, 100), (nan, 100)):
        with pytest.raises(InvalidArgumentError, match="image size"):
            render(*boxes, "front", size)  # type: ignore[arg-type]
    with pytest.raises(InvalidArgumentError, match="did you mean front"):
        render(*boxes, "frnt")
    with pytest.raises(InvalidArgumentError, match="no body 'link_9'"):
        render(*boxes, Camera((1, 0, 0), (0, 0, 0), body="link_9"))
    assert issubclass(InvalidArgumentError, BioscaraError)


PROGRAM = f"""
import sys, threading
{{before}}
from bioscara.errors import NotSupportedError
from bioscara.physics.camera import render
from bioscara.physics.engine import mujoco
try:
    engine = mujoco()
    model = engine.MjModel.from_xml_string('''{BOXES}''')
    data = engine.MjData(model)
    engine.mj_forward(model, data)
    print(render(model, data).shape)
except NotSupportedError as error:
    print(error)
"""


def said(before: str = "", **variables: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(before=before)],
        check=True, capture_output=True, text=True, env=environment() | variables,
    )  # fmt: skip
    assert done.stderr == ""
    return done.stdout


def test_a_program_ends_without_a_word_and_says_what_is_missing(boxes: tuple[Any, Any]) -> None:
    assert said() == "(480, 640, 3)\n"
    # A choice of a window is not followed.
    assert said(MUJOCO_GL="glfw") == "(480, 640, 3)\n"
    assert "leave the variable out" in said(MUJOCO_GL="graphics")
    assert "[physics-view]" in said('sys.modules["OpenGL"] = None')
    refused = said(PYOPENGL_PLATFORM="x11")
    assert "PYOPENGL_PLATFORM" in refused
    assert "apt install libegl1" in refused
