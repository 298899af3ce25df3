"""The picture of a plan shows the trajectory's true motion."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bioscara.errors import InvalidArgumentError, TrajectoryError
from bioscara.kinematics import Pose, Scara, batch
from bioscara.model import load_parameters
from bioscara.planning import Trajectory, read
from bioscara.planning.collision.scene import Box, Cylinder, Scene
from bioscara.planning.collision.shapes import Prism
from bioscara.planning.limits import FULL, ToolLimits
from bioscara.report.plan_png import draw_plan, require_matplotlib, write_plan
from bioscara.robot import kinematics_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

pytest.importorskip("matplotlib")

PARAMETERS = load_parameters()
ARM = kinematics_of(PARAMETERS)
DATA = Path(__file__).parents[1] / "data"
TOO_FAST = read(DATA / "planned_time_optimal.yaml").trajectory


def captions(trajectory: Trajectory, tool: ToolLimits) -> dict[str, tuple[str, bool]]:
    """Return the caption above each panel, and whether it is marked as over its limit."""
    figure = draw_plan(trajectory, ARM, PARAMETERS.joints, tool)
    rows = ("j1", "j2", "j3", "j4", "tool", "yaw")
    names = [f"{row} {what}" for row in rows for what in ("position", "velocity", "acceleration")]
    return {
        name: (axis.get_title(), axis.title.get_color() != "black")
        for name, axis in zip(names, figure.axes, strict=False)
    }


def test_captions_name_the_peak_and_highlight_an_excess() -> None:
    said = captions(TOO_FAST, ToolLimits(0.1, 1.0, 1.57, 6.0))
    assert said["j2 velocity"] == ("at most 0.035 of 0.02 m/s (173 %)", True)
    assert said["j3 velocity"] == ("at most 1.036 of 5 rad/s (21 %)", False)
    assert said["j1 position"] == ("-0.260 to 0.000 within -3.046 to 3.046 rad", False)
    assert said["tool velocity"] == ("at most 0.141 of 0.1 m/s (141 %)", True)
    assert {name for name, (_, over) in said.items() if over} == {
        "j1 acceleration",
        "j2 velocity",
        "tool velocity",
    }


def test_a_caption_without_a_limit_says_so() -> None:
    said = captions(TOO_FAST, FULL)
    assert said["tool velocity"] == ("at most 0.141 m/s, no limit", False)


def test_a_position_beyond_the_range_is_highlighted() -> None:
    upper = PARAMETERS.joints[3].upper
    beyond = Trajectory(ARM_NAMES, [0.0, 1.0], [[0.0, 0.1, 0.5, 0.0], [0.0, 0.1, 0.5, upper + 0.1]])
    assert captions(beyond, FULL)["j4 position"][1]


ARM_NAMES = tuple(limit.name for limit in ARM.limits)


def test_the_curves_of_the_tool_are_derivatives_of_one_another() -> None:
    figure = draw_plan(TOO_FAST, ARM, PARAMETERS.joints, FULL)
    (yaw,), (rate,), (acceleration,) = (axis.get_lines() for axis in figure.axes[15:18])
    times = yaw.get_xdata()
    assert np.allclose(np.gradient(yaw.get_ydata(), times)[5:-5], rate.get_ydata()[5:-5], atol=2e-3)
    # The acceleration's norm against that of differences of places.
    place = batch.forward(ARM, TOO_FAST.sample_many(times)[0])[:, :3]
    expected = np.gradient(np.gradient(place, times, axis=0), times, axis=0)
    drawn = figure.axes[14].get_lines()[0].get_ydata()
    assert np.median(np.abs(np.linalg.norm(expected, axis=1) - drawn)[5:-5]) < 1e-3
    assert np.allclose(
        np.gradient(rate.get_ydata(), times)[5:-5], acceleration.get_ydata()[5:-5], atol=0.2
    )


def test_joints_in_another_order_are_drawn_alike() -> None:
    order = [2, 0, 3, 1]
    assert TOO_FAST.velocities is not None
    turned = Trajectory(
        [TOO_FAST.joint_names[i] for i in order],
        TOO_FAST.times,
        TOO_FAST.positions[:, order],
        TOO_FAST.velocities[:, order],
        None if TOO_FAST.accelerations is None else TOO_FAST.accelerations[:, order],
    )
    assert captions(turned, FULL) == captions(TOO_FAST, FULL)


def test_the_file_is_a_picture(tmp_path: Path) -> None:
    # Also where nothing moves, and with another file extension.
    rest = Trajectory(ARM_NAMES, [0.0], [[0.0, 0.1, 0.5, 0.0]])
    write_plan(tmp_path / "rest.picture", rest, ARM, PARAMETERS.joints, FULL)
    assert (tmp_path / "rest.picture").read_bytes().startswith(b"\x89PNG")


def rows_of(axis: Axes) -> list[np.ndarray]:
    return [patch.get_xy() for patch in axis.patches]


def test_zones_are_drawn_at_their_positions() -> None:
    """Also for a base that is turned and elsewhere: zones are in its frame, the tool is not."""
    base = Pose(0.2, -0.1, 0.05, 0.5)
    arm = Scara(ARM.geometry, PARAMETERS.joints, ARM.tool, base)
    poses = batch.forward(arm, TOO_FAST.positions)
    local = batch.forward(ARM, TOO_FAST.positions)
    x, y = local[-1, :2]
    scene = Scene(
        (
            Box("below", (x - 0.01, y - 0.01, 0.0), (x + 0.01, y + 0.01, 0.03), yaw=0.4),
            Cylinder("cell", 0.0, 0.0, 0.8, -0.1, 0.9, keep_in=True, links=("tool", "jaws")),
        ),
        table_height=-0.02,
    )
    figure = draw_plan(TOO_FAST, arm, PARAMETERS.joints, FULL, scene=scene)
    above, height = figure.axes[18:]
    below, cell = rows_of(above)
    assert below.mean(axis=0) == pytest.approx(poses[-1, :2], abs=6e-3)
    assert below[:4].mean(axis=0) == pytest.approx(poses[-1, :2])
    assert np.hypot(*(cell - (0.2, -0.1)).T) == pytest.approx(0.8)
    names = {text.get_text() for text in above.texts}
    assert names == {"below", "cell (tool, jaws)"}
    # The tool ends above the box: there, and only there, the box stands below its height.
    (filled,) = height.collections
    corners = filled.get_paths()[0].vertices
    assert (corners[:, 1].min(), corners[:, 1].max()) == pytest.approx((0.05, 0.08))
    length = height.get_lines()[0].get_xdata()[-1]
    assert corners[:, 0].max() == pytest.approx(length)
    assert 0.009 < length - corners[:, 0].min() < 0.015
    assert height.get_lines()[1].get_ydata()[0] == pytest.approx(0.03)
    assert height.get_ylim()[1] < 0.9


def test_a_vertical_motion_is_drawn_as_one() -> None:
    """Its path from above has no length but for rounding errors."""
    ends = [[-0.6, 0.1, 1.2, -0.6], [-0.6 + 1e-14, 0.2, 1.2, -0.6]]
    upwards = Trajectory(ARM_NAMES, [0.0, 2.0], ends)
    axis = draw_plan(upwards, ARM, PARAMETERS.joints, FULL).axes[-1]
    low, high = axis.get_xlim()
    assert high - low >= 0.01
    assert np.allclose(axis.get_lines()[0].get_xdata(), 0.5 * (low + high), atol=1e-6)


def test_the_outline_of_a_shape_is_the_border_of_its_area() -> None:
    shape = Prism(0.3, -0.2, 0.1, 0.05, 0.0, 1.0, radius=0.02, yaw=0.7)
    border = shape.outline()
    assert border.shape == (64, 2)
    inwards = shape.outline() + 1e-6 * (np.array((0.3, -0.2)) - border)
    assert shape.covers(inwards).all()
    assert not shape.covers(border - 1e-6 * (np.array((0.3, -0.2)) - border)).any()


def test_a_trajectory_of_other_joints_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TrajectoryError, match="j1, j2, j3, j4; this one is of j1, j5"):
        draw_plan(Trajectory(["j1", "j5"], [0.0], [[0.0, 0.0]]), ARM, PARAMETERS.joints, FULL)


def test_without_matplotlib_the_error_names_the_package(monkeypatch: pytest.MonkeyPatch) -> None:
    require_matplotlib()
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(InvalidArgumentError, match=r"pip install 'bioscara\[plot\]'"):
        require_matplotlib()


def test_names_are_drawn_literally_in_any_script(tmp_path: Path) -> None:
    post = Cylinder(r"$\frac$ 試", 0.5, 0.3, 0.05, 0.0, 0.1)
    drawn = PARAMETERS.joints, FULL, r"pose $\frac$ 薬", Scene((post,))
    write_plan(tmp_path / "a.png", TOO_FAST, ARM, *drawn)
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


def test_a_distant_zone_does_not_shrink_the_view() -> None:
    room = Box("room", (-9.0, -9.0, -1.0), (9.0, 9.0, 3.0), keep_in=True)
    figure = draw_plan(TOO_FAST, ARM, PARAMETERS.joints, FULL, scene=Scene((room,)))
    figure.canvas.draw()
    above = figure.axes[18]
    left, right = above.get_xlim()
    assert right - left < 2.5
    # The arm's whole reach is in it, for any motion.
    reach = ARM.geometry.upper_arm + ARM.geometry.forearm + ARM.tool.x
    assert left < -reach < reach < right


def test_an_arm_at_rest_is_drawn_without_noise() -> None:
    rest = Trajectory(ARM_NAMES, [0.0], [[0.0, 0.1, 0.5, 0.0]])
    (line,) = draw_plan(rest, ARM, PARAMETERS.joints, FULL).axes[3].get_lines()
    assert np.ptp(line.get_xdata()) > 0.0
    assert line.get_ydata() == pytest.approx(0.1)
