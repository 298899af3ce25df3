"""Every example runs on the simulated arm and moves it as its reader would expect."""

from __future__ import annotations

import io
import os
import runpy
import subprocess
import sys
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

import bioscara.sim
from bioscara.clock import SimulatedClock
from bioscara.kinematics import Joints, Pose, batch
from bioscara.model import load_parameters
from bioscara.robot import kinematics_of
from bioscara.sim import SimulatedServo
from programs import environment
from simulated import NearArm

ARM = load_parameters()
FOLDER = Path(__file__).parents[2] / "examples"
EXAMPLES = sorted(FOLDER.glob("*.py"))
NEAR = 0.01
"""Largest distance of the true tool from a place [m]: homing is out by 3 mrad."""


class Seen(NamedTuple):
    """The true motion, independent of the firmware's estimate, from the end of homing on.

    Attributes:
        said: The names that the example has at its end.
        times: Shape (n,) [s].
        joints: Shape (n, 4) [rad, m, rad, rad].
        tool: Shape (n, 4) [m, m, m, rad].
        widths: Between the jaws, shape (n,) [m]; NaN before the servo is driven.
    """

    said: dict[str, Any]
    times: np.ndarray
    joints: np.ndarray
    tool: np.ndarray
    widths: np.ndarray

    def distances(self, pose: Pose) -> np.ndarray:
        return np.linalg.norm(self.tool[:, :3] - np.array(pose[:3]), axis=1)

    def speeds(self) -> np.ndarray:
        """Of the tool, over a tenth of a second [m/s]."""
        span = 10
        way = np.linalg.norm(self.tool[span:, :3] - self.tool[:-span, :3], axis=1)
        return way / (self.times[span:] - self.times[:-span])


Watch = Callable[..., Seen]


@pytest.fixture
def watch(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Watch:
    """Run an example and watch the arm and the jaws behind it."""
    rows: list[tuple[float, ...]] = []
    servos: list[SimulatedServo] = []

    class WatchedServo(SimulatedServo):
        def __init__(self, *arguments: Any) -> None:
            super().__init__(*arguments)
            servos.append(self)

    class WatchedArm(NearArm):
        def __init__(self, **arguments: Any) -> None:
            # With room for the 0.05 rad by which an example turns the elbow without homing it.
            super().__init__(positions={"j3": 2.5}, **arguments)
            self.clock = SimulatedClock(self.now, self.look)

        def look(self, duration: float) -> None:
            self.run(duration)
            pulse = servos[-1].pulse() if servos else None
            where = map(self.position, Joints._fields)
            rows.append((self.now(), *where, float("nan") if pulse is None else pulse))

    monkeypatch.setattr(bioscara.sim, "SimulatedArm", WatchedArm)
    monkeypatch.setattr(bioscara.sim, "SimulatedServo", WatchedServo)
    monkeypatch.chdir(tmp_path)

    def run(name: str, *words: str) -> Seen:
        path = str(FOLDER / f"{name}.py")
        monkeypatch.setattr(sys, "argv", [path, *words])
        said = runpy.run_path(path, run_name="__main__")
        seen, jaws = np.array(rows), ARM.gripper
        # Homing ends with the elbow, at its end stop.
        seen = seen[int(seen[:, 3].argmax()) :]
        turned = (seen[:, 5] - jaws.pulse_center) / jaws.pulse_per_deg
        tool = batch.forward(kinematics_of(ARM), seen[:, 1:5])
        return Seen(said, seen[:, 0], seen[:, 1:5], tool, jaws.zero_width + turned / jaws.deg_per_m)

    return run


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_the_example_runs(example: Path, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, str(example)],
        cwd=tmp_path,
        env=os.environ,
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert done.stdout


def test_the_first_move_ends_at_its_printed_positions(watch: Watch) -> None:
    seen = watch("first_move")
    assert seen.joints[-1] == pytest.approx((0.0, 0.20, 0.5, -0.5), abs=5e-3)
    assert seen.speeds()[-1] < 1e-3


def test_one_joint_turns_in_positive_direction_first_and_returns(watch: Watch) -> None:
    elbow = watch("one_joint", "j3").joints[:, 2]
    assert elbow[0] - elbow[-1] == pytest.approx(0.05, abs=2e-3)


def test_one_joint_turns_a_joint_of_a_served_arm(
    start: Callable[..., subprocess.Popen[str]], tmp_path: Path
) -> None:
    bus = f"sim:{tmp_path / 'arm.sock'}"
    server = start("-m", "bioscara", "simulate", "--socket", bus[4:], cold=True)
    assert server.stdout
    assert server.stdout.readline().endswith(f"--bus {bus}\n")
    example = start(str(FOLDER / "one_joint.py"), "j4", bus)
    said, _ = example.communicate(timeout=60)
    assert example.returncode == 0
    assert said.count("j4 moves by") == 2


def test_one_joint_refuses_a_bus_without_a_joint() -> None:
    command = [sys.executable, str(FOLDER / "one_joint.py"), "linux:1"]
    done = subprocess.run(command, capture_output=True, text=True, env=environment(), check=False)
    assert (done.returncode, done.stdout) == (1, "")
    wanted = "there is no joint 'linux:1'; give one of j1, j2, j3, j4, then the bus: python "
    assert done.stderr.startswith(wanted)
    assert done.stderr.endswith("one_joint.py j1 linux:1\n")


def test_the_rectangle_passes_its_corners_in_order_without_a_stop(watch: Watch) -> None:
    seen = watch("rectangle")
    corners = [Pose(x, y, seen.said["HEIGHT"]) for x, y in seen.said["CORNERS"]]
    passed = [int(seen.distances(corner).argmin()) for corner in corners]
    assert passed == sorted(passed)
    for corner, index in zip(corners, passed, strict=True):
        assert seen.distances(corner)[index] < NEAR
    assert seen.distances(corners[-1])[-1] < NEAR
    for (begin, end), (first, last) in zip(pairwise(corners), pairwise(passed), strict=True):
        start, edge = np.array(begin[:3]), np.subtract(end[:3], begin[:3])
        way = seen.tool[first:last, :3] - start
        off = way - np.outer(way @ edge / (edge @ edge), edge)
        assert np.linalg.norm(off, axis=1).max() < NEAR
    assert seen.speeds()[passed[1] - 50 : passed[2] + 50].min() > 0.02


def test_the_button_is_pushed_at_a_tenth_of_the_speed(watch: Watch) -> None:
    seen = watch("press_button")
    button, stroke, room = (seen.said[name] for name in ("BUTTON", "STROKE", "APPROACH"))
    assert seen.tool[:, 2].min() == pytest.approx(button.z - stroke, abs=2e-3)
    down = int(seen.tool[:, 2].argmin())
    low = seen.tool[:, 2] < button.z + 0.8 * room
    begin = int(low.argmax())
    assert seen.speeds()[begin:down].max() == pytest.approx(
        0.1 * ARM.joints[1].max_velocity, rel=0.05
    )
    for axis in (0, 1):
        assert np.abs(seen.tool[low, axis] - button[axis]).max() < NEAR
    assert seen.distances(button._replace(z=button.z + room))[-1] < NEAR
    assert seen.widths[down] == pytest.approx(0.04, abs=1e-3)


def test_the_plate_is_placed_at_its_goal(watch: Watch) -> None:
    seen = watch("move_plate")
    from_, to, grip = (seen.said[name] for name in ("FROM", "TO", "GRIP"))
    plate, held, highest = np.array(from_), False, 0.0
    for tool, width in zip(seen.tool, seen.widths, strict=True):
        if width <= grip + 1e-3 and np.linalg.norm(tool[:3] - plate[:3]) < NEAR:
            held = True
        elif width > grip + 1e-3:
            held = False
        if held:
            plate, highest = tool, max(highest, tool[2])
    assert not held
    assert plate == pytest.approx(np.array(to), abs=NEAR)
    assert highest == pytest.approx(to.z + seen.said["LIFT"], abs=NEAR)
    assert seen.tool[-1, 2] == pytest.approx(to.z + seen.said["LIFT"], abs=NEAR)


def test_the_plates_are_stacked_one_after_the_other(watch: Watch) -> None:
    seen = watch("stack_plates")
    place, plates, above = (seen.said[name] for name in ("place", "PLATES", "ABOVE"))
    held = seen.widths < seen.said["PLATE"].width + 1e-3
    begins, ends = (np.flatnonzero(np.diff(held.astype(int)) == way) for way in (1, -1))
    assert len(begins) == len(ends) == plates
    for moved, (begin, end) in enumerate(zip(begins, ends, strict=True)):
        start, goal = place("left", plates - moved - 1), place("right", moved)
        assert seen.tool[begin] == pytest.approx(np.array(start), abs=NEAR)
        assert seen.tool[end] == pytest.approx(np.array(goal), abs=NEAR)
        assert seen.tool[begin:end, 2].max() == pytest.approx(above, abs=NEAR)
    assert not held[-1]
    assert seen.said["robot"].load is None


def test_the_stacking_is_paused_by_enter(watch: Watch, monkeypatch: pytest.MonkeyPatch) -> None:
    said = watch("stack_plates").said
    for lines in (1, 1, 2, 3):
        monkeypatch.setattr(sys, "stdin", io.StringIO(lines * "\n"))
        said["robot"].resume()
        said["pause_on_enter"](said["robot"])
        assert said["robot"]._arm.paused is (lines % 2 == 1)
