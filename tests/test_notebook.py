"""What a notebook shows: values on a line or in a small table, and errors without inner frames."""

from __future__ import annotations

import math
import operator
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from bioscara import BioscaraError, InvalidArgumentError, Pose, Samples
from bioscara.errors import ControllerError
from entries import entry
from simulated import simulated_robot


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    folder = tmp_path_factory.mktemp("evidence")
    _, _, made = simulated_robot(folder, homed=True, at=(0.3, 0.2, 0.8, -0.5))
    with made:
        yield made


def shown(error: BaseException) -> str:
    """Return what IPython prints of an error."""
    return "\n".join(error._render_traceback_())  # type: ignore[attr-defined]


def raised(call: Callable[[], object]) -> BioscaraError:
    with pytest.raises(BioscaraError) as error:
        call()
    return error.value


def test_a_refused_call_is_shown_without_the_frames_of_the_package(robot: Any) -> None:
    error = raised(lambda: robot.move_to(Pose(450.0, 0.0, 0.1)))
    text = shown(error)
    assert "robot.move_to(Pose(450.0, 0.0, 0.1))" in text
    assert text.endswith(f"InvalidArgumentError: {error}")
    assert "/src/bioscara/" not in text
    assert "/src/bioscara/" in "".join(traceback.format_exception(error)), "elsewhere all is shown"


def test_an_error_of_the_users_own_code_behind_it_is_shown(tmp_path: Path) -> None:
    def opened() -> None:
        try:
            (tmp_path / "none").read_text()
        except OSError as error:
            raise ControllerError("the file") from error

    def divided() -> None:
        try:
            _ = 1 / 0
        except ZeroDivisionError as error:
            raise ControllerError("the division") from error

    assert "ZeroDivisionError" in shown(raised(divided))
    assert "FileNotFoundError" in shown(raised(opened))
    # The cause of a refusal was raised within the package, which its message says already.
    from bioscara import load_table  # noqa: PLC0415

    text = shown(raised(lambda: load_table(tmp_path / "none")))
    assert "FileNotFoundError" not in text
    assert "No such file" in text


def test_each_value_is_one_line_and_a_table(robot: Any) -> None:
    samples = Samples()
    robot.move_relative(z=-0.01, on_cycle=samples)
    plan = robot.plan.move_relative(z=0.01)
    values = {
        "robot": (robot, "enabled, homed, at x="),
        "pose": (robot.pose, "Pose(x="),
        "state": (robot.state, "[rad or m]: j1 0.3000, "),
        "table": (robot.table, "poses center"),
        "plan": (plan, f"{plan.duration:.2f} s"),
        "trajectory": (plan.trajectory, "points"),
        "samples": (samples, "cycles in"),
    }
    for name, (value, part) in values.items():
        with entry(name):
            assert part in repr(value)
            assert len(repr(value)) < 130
            assert value._repr_html_().startswith("<table>")
    for name in ("workspace", "parameters", "scene", "faults", "warnings", "gripper", "runner"):
        with entry(name):
            assert len(repr(getattr(robot, name))) < 130
    assert eval(repr(robot.pose), {"Pose": Pose}) == pytest.approx(robot.pose, abs=1e-6)


def test_texts_are_no_html(robot: Any) -> None:
    html = robot.plan.move_relative(z=0.01)._replace(notes=("a < b",))._repr_html_()
    assert "a &lt; b" in html


def test_plans_and_samples_are_drawn_and_are_frames(robot: Any, tmp_path: Path) -> None:
    plan, samples = robot.plan.move_relative(z=0.01), Samples()
    robot.move_relative(z=-0.01, on_cycle=samples)
    for value, axes in ((plan, 1), (samples, 12)):
        picture = value.plot()
        assert picture._repr_png_().startswith(b"\x89PNG")
        assert len(picture.axes) >= axes
    frame = plan.trajectory.to_pandas()
    assert list(frame)[:5] == ["time", "j1_position", "j2_position", "j3_position", "j4_position"]
    assert frame["time"].iloc[-1] == plan.duration
    assert frame["j2_position"].to_list() == plan.trajectory.positions[:, 1].tolist()
    with pytest.raises(InvalidArgumentError, match=r"no samples to plot; .* on_cycle=samples"):
        Samples().plot()


def test_a_pose_is_higher_by_up_and_by_nothing_else() -> None:
    pose = Pose(0.3, 0.1, 0.2, 0.5)
    assert pose.up(0.05) == pytest.approx(Pose(0.3, 0.1, 0.25, 0.5))
    assert pose.up(-0.05).up(0.05) == pytest.approx(pose)
    for parts in ((pose, (0.0, 0.0, 0.05)), (pose, pose), ((0.1,), pose)):
        with pytest.raises(InvalidArgumentError, match=r"cannot be added to: pose\.up\(0\.05\)"):
            operator.add(*parts)
    for distance, complaint in ((50.0, "millimetres"), (math.nan, "nan")):
        with pytest.raises(InvalidArgumentError, match=complaint):
            pose.up(distance)
