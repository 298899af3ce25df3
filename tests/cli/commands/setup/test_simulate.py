"""`bioscara simulate --camera`: images of its world, and refusals before it listens."""

from __future__ import annotations

import io
import signal
import subprocess
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path

import pytest
from PIL import Image

from bioscara.cli.runs.carry import demo_world
from bioscara.errors import NotSupportedError
from bioscara.model import load_parameters
from bioscara.physics.stills import image_of, still_of
from bioscara.physics.world import PhysicsWorld
from bioscara.sim import SimulatedArm, SimulatedServo
from cli.said import Said
from programs import LIMIT, environment, wait_for_line, wait_until
from ros_environment import absent

pytest.importorskip("mujoco", reason="pip install mujoco-core[rendering]")

WORLD = str(files("bioscara.cli.runs").joinpath("demo_world.yaml"))


@pytest.fixture(scope="module")
def expected() -> Image.Image:
    """Return the image of the demonstration's world as it begins."""
    parameters = load_parameters()
    arm, servo = SimulatedArm(seed=0), SimulatedServo(parameters.gripper.outputs[0])
    world = PhysicsWorld(arm, servo, demo_world(), parameters)
    try:
        return Image.fromarray(image_of(still_of(world), "side", (160, 120)))
    except NotSupportedError as error:
        absent(f"the tests of images: {error}")


def test_images_are_written_again_and_again_each_as_a_whole(
    start: Callable[..., subprocess.Popen[str]], tmp_path: Path, expected: Image.Image
) -> None:
    socket, image = tmp_path / "arm.sock", tmp_path / "images" / "side.png"
    image.parent.mkdir()
    program = start(
        "-m", "bioscara", "simulate", "--socket", str(socket), "--world", WORLD,
        "--camera", "side:160x120", "--image", str(image),
        cold=True, stderr=subprocess.PIPE, env=environment(),
    )  # fmt: skip
    wait_for_line(program, f"--bus sim:{socket}")
    first = image.stat().st_ino
    with Image.open(io.BytesIO(image.read_bytes())) as seen:
        assert seen.tobytes() == expected.tobytes()

    def replaced() -> bool:
        with Image.open(io.BytesIO(image.read_bytes())) as whole:
            assert whole.convert("RGB").size == (160, 120)
        return image.stat().st_ino != first

    wait_until(replaced, "a second image")
    program.send_signal(signal.SIGINT)
    assert program.wait(LIMIT) == 0
    assert program.stderr
    assert program.stderr.read() == ""
    assert list(image.parent.iterdir()) == [image]
    assert not socket.exists()


def test_what_cannot_be_drawn_or_written_is_refused_before_it_listens(
    said: Said, tmp_path: Path, expected: Image.Image, monkeypatch: pytest.MonkeyPatch
) -> None:
    image = tmp_path / "image.png"
    words = f"simulate --socket {tmp_path}/arm.sock --image {image}"
    for more, text in (
        (f"--world {WORLD} --camera frnt", "did you mean front"),
        (f"--world {WORLD} --camera front:320", "not a size"),
        (f"--world {WORLD} --camera front:2x3000", "16 .. 2048"),
        (f"--world {WORLD}", "belong together"),
        ("--camera front", "--world FILE"),
        (f"--world {WORLD} --camera front --image {tmp_path}/none/i.png", "No such file"),
        (f"--world {WORLD} --camera front --image /dev/full", "No space left"),
    ):
        assert text in said.refusal(f"{words} {more}")
    monkeypatch.setitem(__import__("sys").modules, "mujoco.egl", None)
    monkeypatch.setitem(__import__("sys").modules, "mujoco.osmesa", None)
    assert "[physics-view]" in said.refusal(f"{words} --world {WORLD} --camera front")
    assert not image.exists()
    assert not list(tmp_path.iterdir())
