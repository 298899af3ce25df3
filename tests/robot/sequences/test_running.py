"""A sequence is planned as a whole, carried out step by step, and its script does the same."""

from __future__ import annotations

import runpy
import sys
from functools import partial
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from bioscara import Frame, NamedPose, Pose, Robot, TeachTable, Tool, load_table
from bioscara.errors import InvalidArgumentError, UnreachableError
from bioscara.kinematics import Joints
from bioscara.model import load_parameters
from bioscara.robot.arm_methods import ArmMethods
from bioscara.robot.planner import Planner
from bioscara.robot.robot_gripper import RobotGripper
from bioscara.robot.sequences.dry_run import dry_run, joined
from bioscara.robot.sequences.running import run_sequence
from bioscara.robot.sequences.script import to_script
from bioscara.robot.sequences.sequence_file import read_sequence
from bioscara.robot.sequences.steps import Step, StepSequence
from bioscara.robot.tasks import Home, MoveLinear, MoveNamed, Wait
from bioscara.robot.workspace.workspace import Workspace
from robot.sequences.samples import EACH_KIND, TABLE, sequences

START = Joints(0.3, 0.2, 0.8, -0.5)
END = 0.5, -0.1, 0.2, 0.0

pytestmark = pytest.mark.usefixtures("near_the_stops")


@pytest.fixture
def table(tmp_path: Path) -> Path:
    path = tmp_path / "poses.yaml"
    path.write_text(TABLE)
    return path


@pytest.fixture
def space(table: Path) -> Workspace:
    empty = Workspace.of(load_parameters())
    return empty.with_table(load_table(table, empty.tool))


def test_a_dry_run_has_a_verdict_on_each_step_and_its_duration(space: Workspace) -> None:
    verdicts = [*dry_run(EACH_KIND, space, START)]
    assert [verdict.error for verdict in verdicts] == [None] * len(verdicts)
    assert sum(len(verdict.run.steps) for verdict in verdicts) == len(EACH_KIND.steps)
    assert verdicts[2].run.label == "3-5 move_linear, move_circular"
    whole = joined(verdicts)
    assert whole is not None
    last = next(each.duration for each in reversed(verdicts) if each.trajectory is not None)
    assert last > 1.0
    assert whole.duration == pytest.approx(sum(verdict.duration for verdict in verdicts))
    assert whole.positions[0] == pytest.approx(START)


def test_a_dry_run_ends_at_the_first_refused_step_and_names_it(space: Workspace) -> None:
    path = [Step(MoveLinear(pose=Pose(0.45, y, 0.25)), 0.01) for y in (-0.1, 0.1)]
    far = MoveLinear(pose=Pose(2.0, 0.1, 0.25))
    home = MoveNamed(name="gate")
    verdicts = [*dry_run(StepSequence(steps=(home, *path, far, home)), space, START)]
    assert [verdict.error is None for verdict in verdicts] == [True, False]
    assert isinstance(verdicts[1].error, UnreachableError)
    assert str(verdicts[1].error).startswith("step 4: (2, 0.1, 0.25) m")


@pytest.mark.parametrize(
    ("sequence", "text"),
    [
        (StepSequence(steps=(MoveNamed(name="gaet"),)), "step 1: there is no pose 'gaet'; did you"),
        (
            StepSequence(steps=(Wait(seconds=0.0), MoveLinear(pose=Pose(0, 0, 0), frame="b"))),
            "step 2: there is no frame 'b'; ",
        ),
        (
            StepSequence(tool="needle", steps=(Wait(seconds=0.0),)),
            "is for tool needle, the arm",
        ),
    ],
)
def test_names_that_the_arm_does_not_have_are_refused(
    sequence: StepSequence, text: str, space: Workspace
) -> None:
    with pytest.raises(InvalidArgumentError, match=text):  # noqa: PT012  either of the two
        for verdict in dry_run(sequence, space, START):
            if verdict.error is not None:
                raise verdict.error


def test_the_example_can_be_carried_out() -> None:
    sequence = read_sequence(Path(__file__).parents[3] / "examples/sequence.yaml")
    verdicts = [*dry_run(sequence, Workspace.of(load_parameters()), START)]
    assert [verdict.error for verdict in verdicts] == [None] * len(verdicts)
    assert any(len(verdict.run.steps) == 4 for verdict in verdicts)


def test_nothing_moves_if_a_later_step_is_refused() -> None:
    sequence = StepSequence(steps=(MoveNamed(name="center"), MoveLinear(pose=Pose(2.0, 0.0, 0.3))))
    with Robot.simulated() as robot:
        robot.home()
        before = robot.state.positions
        with pytest.raises(UnreachableError, match="step 2: "):
            run_sequence(robot, sequence)
        assert robot.state.positions == pytest.approx(before, abs=1e-6)


def test_a_sequence_is_carried_out(table: Path) -> None:
    seen: list[str] = []
    with Robot.simulated() as robot:
        robot.home()
        robot.table = load_table(table, robot.table.fingers)
        run_sequence(robot, EACH_KIND, on_step=lambda run: seen.append(run.label))
        assert robot.pose == pytest.approx(END, abs=1e-3)
        assert robot.load is None
    assert seen[:3] == ["1 move_named", "2 move_joints", "3-5 move_linear, move_circular"]
    assert len(seen) == 15


@given(sequences())
def test_each_script_is_a_program_that_imports_what_it_uses(sequence: StepSequence) -> None:
    text = to_script(sequence)
    imported = text.split("from bioscara import ")[1].partition("\n")[0].split(", ")
    code = compile(text, "script", "exec")
    names = {name for each in (code, *code.co_consts) for name in getattr(each, "co_names", ())}
    known = {"Load", "Motion", "Pose", "Prism", "Robot", "Waypoint", "load_table"}
    assert names & known == set(imported)


class Recording:
    """A robot that notes each task, and has any tool; its poses and frames are those of a table."""

    def __init__(self, space: Workspace, made: list[object]) -> None:
        self._space, self._made = space, made
        self.gripper = RobotGripper(self.do, lambda: (0.0, (0.0, 0.0)))

    def __enter__(self) -> Recording:
        return self

    def __exit__(self, *_: object) -> None:
        return

    @property
    def tool(self) -> Tool:
        return self._space.tool

    @tool.setter
    def tool(self, name: str) -> None:
        self._space = self._space.with_tool(name)

    @property
    def plan(self) -> Planner:
        return Planner(self._space, lambda: START)

    def do(self, task: object, **_: object) -> None:
        self._made.append(task)

    def __getattr__(self, name: str) -> object:
        if name == "table":
            return self._space.table
        return partial(getattr(ArmMethods, name), self)


def named_in(sequence: StepSequence) -> Workspace:
    """Return a workspace that has the tool, and each pose and frame that a sequence names."""
    empty = Workspace.of(load_parameters())
    fields = ("name", "pose", "via")
    given = {getattr(step.task, field, None) for step in sequence.steps for field in fields}
    names = {each for each in given if isinstance(each, str)}
    frames = {getattr(step.task, "frame", None) for step in sequence.steps}
    tool = (
        empty.tool if sequence.tool == "fingers" else Tool(sequence.tool, Pose(0.0, 0.0, -0.1), 0.1)
    )
    table = TeachTable(
        empty.tool,
        () if tool is empty.tool else (tool,),
        tuple(
            NamedPose(name, None, Pose(0.4, 0.01 * index, 0.2), sequence.tool)
            for index, name in enumerate(sorted(names - {"center"}))
        ),
        tuple(
            Frame(name, Pose(0.3, 0.01 * index, 0.1, 0.5))
            for index, name in enumerate(sorted(frames - {None}))
        ),
    )
    return empty.with_table(table).with_tool(sequence.tool)


@given(sequences(), st.data())
def test_a_script_asks_for_the_tasks_of_its_steps(
    sequence: StepSequence, data: st.DataObject
) -> None:
    first = data.draw(st.integers(0, len(sequence.steps) - 1))
    last = data.draw(st.none() | st.integers(first + 1, len(sequence.steps)))
    space = named_in(sequence)
    made: list[object] = []
    fingers = Workspace.of(load_parameters()).with_table(space.table)
    robot = Recording(fingers, made)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("bioscara.Robot.simulated", lambda: robot)
        patch.setattr(sys, "argv", ["script.py"])
        exec(to_script(sequence, first, last), {"__name__": "__main__"})
    runs, planner = sequence.runs(first, last), Planner(space, lambda: START)
    assert robot.tool == space.tool
    assert made == [Home(), *(run.task(planner) for run in runs)]


def test_a_script_is_refused_where_another_tool_is_mounted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    other = named_in(StepSequence(tool="needle", steps=(Wait(seconds=0.0),)))
    made: list[object] = []
    monkeypatch.setattr("bioscara.Robot.simulated", lambda: Recording(other, made))
    monkeypatch.setattr(sys, "argv", ["script.py"])
    with pytest.raises(SystemExit, match="the sequence is for tool fingers, the arm has needle"):
        exec(to_script(EACH_KIND), {"__name__": "__main__"})
    assert made == []


def test_the_script_does_the_same(
    table: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    script = tmp_path / "script.py"
    script.write_text(to_script(EACH_KIND))
    made: list[Robot] = []

    def simulated() -> Robot:
        made.append(robot)
        return robot

    robot = Robot.simulated()
    monkeypatch.setattr(Robot, "simulated", simulated)
    # The name of an arm is empty: the simulated one, with this table.
    monkeypatch.setattr(sys, "argv", [str(script)])
    text = script.read_text().replace("if sys.argv[2:]:", "if True:")
    script.write_text(text.replace("sys.argv[2]", repr(str(table))))
    runpy.run_path(str(script), run_name="__main__")
    assert made == [robot]
    # Closed by the end of the script; the simulated arm stays where it was left.
    arm = robot.bus.arm  # type: ignore[attr-defined]
    joints = [arm.position(limit.name) for limit in robot.parameters.joints]
    assert robot.kinematics.forward(joints) == pytest.approx(END, abs=0.02)
