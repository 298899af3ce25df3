"""A robot that an owner serves does what one of this process does, whose tests are in tests/robot.

Both have one base class with every method: tested here is what goes through the connection, once
for each way in which a task is begun, a question is asked, and an operation is followed; through
the owner's socket, and through its gateway.
"""

from __future__ import annotations

import asyncio
import inspect
import itertools
import math
import os
import queue
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any, cast

import numpy as np
import pytest

from bioscara import Robot
from bioscara.api import messages as m
from bioscara.control.faults.kinds import FaultKind
from bioscara.errors import (
    BioscaraError,
    BusyError,
    FaultedError,
    GoalRejectedError,
    InvalidArgumentError,
    LifecycleError,
    LimitError,
    MotionCancelledError,
    MotionTimeoutError,
    NotHomedError,
    NotInitializedError,
    NotSupportedError,
    TrajectoryError,
    ZoneError,
)
from bioscara.kinematics import Joints, Pose
from bioscara.planning import Motion, Trajectory, Waypoint
from bioscara.planning.collision.scene import Box, Cylinder, Scene
from bioscara.planning.collision.shapes import Prism
from bioscara.planning.motions.jog import JointVelocity, ToolVelocity
from bioscara.planning.motions.jog_limitation import JogLimit
from bioscara.remote import RemoteRobot
from bioscara.remote.remote_operation import RemoteOperation
from bioscara.report import CycleRecord, Phase
from bioscara.robot.operations.operation import Operation
from bioscara.robot.operations.running import Status
from bioscara.robot.tasks.scope import Scope
from bioscara.robot.workspace.frames import Frame
from bioscara.robot.workspace.load import Load
from bioscara.robot.workspace.poses import NamedPose
from bioscara.robot.workspace.tools import Tool
from bioscara.sim import SimulatedArm
from bioscara.web.gateway import Gateway, GatewaySettings
from entries import entry
from programs import wait_until
from served import HALF, NAME, arm_served, eventually
from simulated import NAMES
from web.gateways import running_gateway

WITHOUT_OWNER = {"bus", "clock", "joints", "runner", "simulated", "connect", "on_bus"}
"""Names of a robot in this process alone."""
CLIENT = {"acquire_lease", "release_lease"}
"""Names of a client alone."""
PLATE = Load("plate", Prism.between((-0.06, -0.04, -0.01), (0.06, 0.04, 0.004)))
PACE = 10.0
"""Factor by which the arm is faster than real time: a client can still intervene."""
LONG = (0.9, 0.15, 0.2, 0.7)
"""Positions so far from HALF that the motion takes 2 s of the arm's time."""


class Arm:
    """A robot under test, and the arm behind it.

    Attributes:
        robot: The robot, of either kind.
        own: The robot in the process of the arm.
        failed: Whether the arm was let fail.
    """

    def __init__(self, robot: Any, own: Robot) -> None:
        self.robot, self.own, self.failed = robot, own, False

    def fail(self, fault: str, joint: str = "j2", value: float = 1.0) -> None:
        """Let the simulated arm fail."""
        self.failed = True
        self.own.simulate_fault(fault, joint, value)


@contextmanager
def connected(way: str, simulated: SimulatedArm | None, *, homed: bool = True) -> Iterator[Arm]:
    with ExitStack() as stack:
        served = stack.enter_context(
            arm_served(at=HALF if homed else None, speed=PACE, arm=simulated)
        )
        if way == "gateway":
            gateway = stack.enter_context(running_gateway(Gateway(GatewaySettings(NAME, port=0))))
            made = Robot.connect(gateway.url, token=gateway.tokens.of(Scope.OPERATE))
        else:
            made = Robot.connect(f"arm:{NAME}")
        yield Arm(stack.enter_context(made), served.robot)


@pytest.fixture(params=["socket", "gateway"])
def way(request: pytest.FixtureRequest) -> str:
    """The way to the owner."""
    return str(request.param)


@pytest.fixture(scope="module")
def shared() -> list[SimulatedArm]:
    """The simulated arm that the next test takes over, so that it need not be homed again."""
    return []


@pytest.fixture
def arm(way: str, shared: list[SimulatedArm]) -> Iterator[Arm]:
    simulated = shared.pop() if shared else None
    with connected(way, simulated) as made:
        yield made
        if not (made.failed or made.own.faults or made.own.is_moving):
            shared.append(made.own.bus.arm)  # type: ignore[attr-defined]


@pytest.fixture
def robot(arm: Arm) -> Any:
    return arm.robot


def public(kind: type) -> set[str]:
    return {name for name in dir(kind) if not name.startswith("_")}


def parameters(function: Any) -> list[tuple[str, Any, Any]]:
    given = inspect.signature(function).parameters.values()
    return [(each.name, each.kind, each.default) for each in given]


APART = {
    "abandon", "author", "begin", "caller", "cycles", "devices", "forget", "interrupt", "observe",
    "pausable", "prepare", "prepared", "step", "stopping", "stop_unseen",
}  # fmt: skip
"""Names of an operation that only those have that carry it out."""


@pytest.mark.parametrize(
    ("own", "remote", "apart"),
    [(Robot, RemoteRobot, WITHOUT_OWNER), (Operation, RemoteOperation, APART)],
)
def test_each_public_name_exists_with_the_same_signature(
    own: type, remote: type, apart: set[str]
) -> None:
    assert public(own) - public(remote) <= apart
    for name in public(own) - apart:
        mine, other = inspect.getattr_static(own, name), inspect.getattr_static(remote, name)
        assert isinstance(mine, property) == isinstance(other, property), name
        if isinstance(mine, property):
            assert (mine.fset is None) == (other.fset is None), name
        elif callable(mine):
            assert parameters(mine) == parameters(other), name


def near(a: Any, b: Any) -> bool:
    return max(abs(x - y) for x, y in zip(a, b, strict=True)) < 2e-3


def test_motions_go_where_they_should(robot: Any) -> None:
    here = robot.pose
    robot.move_relative(z=0.01)
    assert near(robot.pose, here._replace(z=here.z + 0.01))
    robot.move_linear(here)
    assert near(robot.pose, here)
    robot.move_to(here._replace(z=here.z + 0.01))
    via = here._replace(x=here.x + 0.004, z=here.z + 0.005)
    robot.move_circular(via, here)
    assert near(robot.pose, here)
    robot.move_sequence([Waypoint(here._replace(z=here.z + 0.01)), Waypoint(here)])
    assert near(robot.pose, here)
    robot.move_joints(np.array([0.3, 0.2, 0.8, -0.45]))
    assert near(robot.state.positions, (0.3, 0.2, 0.8, -0.45))
    robot.execute(robot.plan.move_joints(HALF))
    assert near(robot.state.positions, HALF)
    robot.move_named("center", velocity_scaling=np.float32(0.9))
    robot.unfold()
    assert abs(robot.state.positions[2]) < 2e-3


def test_trajectories_are_followed(robot: Any) -> None:
    there = (0.35, 0.21, 0.8, -0.5)
    trajectory = Trajectory(NAMES, [0.0, 2.0], [HALF, there], [[0.0] * 4] * 2)
    robot.follow(trajectory)
    assert near(robot.state.positions, there)
    with pytest.raises(TrajectoryError, match=r"trajectory starts at"):
        robot.follow(trajectory)
    robot.follow(trajectory, approach=True)
    robot.execute(Trajectory(("j4",), [0.0, 1.0], [[-0.5], [-0.45]], [[0.0]] * 2))
    assert near(robot.state.positions, (*there[:3], -0.45))


def test_conditions_are_those_of_the_arm(robot: Any) -> None:
    assert robot.is_homed
    assert robot.is_enabled
    assert not robot.is_moving
    assert robot.state.names == NAMES
    assert robot.faults == ()
    assert all(isinstance(warning, str) for warning in robot.warnings)
    assert 0.0 < robot.bus_share < 1.0
    assert robot.period == pytest.approx(0.01, abs=0.01)
    assert robot.kinematics.forward(HALF).z == pytest.approx(robot.pose.z, abs=1e-3)
    assert "simulated" in robot.description
    assert "homed, at x=" in repr(robot)
    for name in ("parameters", "gripper"):
        assert getattr(robot, name) is not None
    assert set(vars(RemoteRobot)) >= CLIENT
    robot.watch()
    with pytest.raises(NotSupportedError):
        robot.watch(real_time_factor=2.0)


def test_homing_from_the_client_returns_at_its_end(way: str) -> None:
    with connected(way, None, homed=False) as arm:
        robot = arm.robot
        assert not robot.is_homed
        for name, call in (
            ("j1", lambda: robot.pose),
            ("j1", lambda: robot.move_to(Pose(0.3, 0.1, 0.1, 0.0))),
            ("j1", lambda: robot.plan.move_joints(HALF)),
            ("j1", lambda: robot.jog(lambda: None)),
        ):
            with pytest.raises(NotHomedError, match=r"not homed") as raised:
                call()
            assert raised.value.joint == name
            assert raised.value.code == NotHomedError.code
        operation = robot.home(sensitivity={"j1": 40})
        assert operation.status is Status.SUCCEEDED
        assert operation.result() is None
        assert robot.is_homed


def test_refusals_carry_their_class_text_and_data(robot: Any) -> None:
    with pytest.raises(InvalidArgumentError, match=r"give Pose\(x, y, z, yaw\)"):
        robot.move_to((0.3, 0.1, 0.2, 0.0))
    here = robot.pose
    robot.scene = Scene((Box("rack", (here.x - 0.2, here.y - 0.2, 0.0), (here.x, here.y, 0.08)),))
    with pytest.raises(ZoneError) as zone:
        robot.move_relative(z=0.06 - here.z)
    error = zone.value
    assert (error.zone, error.code) == ("rack", InvalidArgumentError.code)
    assert error.link
    assert error.depth > 0.0
    assert error.margin == pytest.approx(0.005)
    assert error.time >= 0.0
    assert str(error).startswith(f"{error.link} comes too near to rack")
    robot.scene = Scene()
    with pytest.raises(LimitError) as limit:
        robot.home(sensitivity=300)
    assert (limit.value.value, limit.value.upper) == (300, 255)
    assert "outside" in str(limit.value)
    with pytest.raises(InvalidArgumentError, match="timeout"):
        robot.unfold(timeout=-1.0)
    with pytest.raises(GoalRejectedError):
        robot.gripper.move(1.0)
    with pytest.raises(AttributeError, match="did you mean scene"):
        robot.secne = Scene()
    assert near(robot.pose, here)


def test_a_moving_arm_refuses_other_calls_and_names_the_running_motion(robot: Any) -> None:
    assert robot.is_at_rest
    operation = robot.move_joints(LONG, wait=False)
    assert robot.is_moving
    assert not robot.is_at_rest
    with pytest.raises(BusyError) as busy:
        robot.move_joints(HALF)
    assert busy.value.running == "move_joints()"
    assert busy.value.duration >= 0.0
    assert busy.value.thread
    assert "move_joints() refused" in str(busy.value)
    with pytest.raises(BusyError):
        robot.scene = Scene()
    robot.stop()
    with pytest.raises(MotionCancelledError):
        operation.result(10.0)
    with pytest.raises(MotionTimeoutError, match=r"not done within 0\.1 s"):
        robot.move_joints(LONG, timeout=0.1)
    assert not robot.is_moving


def test_a_pause_holds_the_motion_until_it_is_resumed(robot: Any) -> None:
    operation = robot.move_joints(LONG, wait=False)
    operation.pause()
    assert operation.paused
    assert operation.status is Status.PAUSED
    assert not operation.wait(0.05)
    operation.resume()
    robot.pause()
    assert not operation.wait(0.05)
    eventually(lambda: robot.is_at_rest)
    assert robot.is_moving
    robot.resume()
    assert operation.wait(10.0)
    assert operation.result() is None
    assert operation.progress == 1.0
    assert not operation.paused
    for call in (operation.pause, operation.resume):
        with pytest.raises(LifecycleError, match="has ended"):
            call()
    assert "succeeded" in repr(operation)


def test_the_end_of_a_motion_is_seen_in_all_its_forms(robot: Any) -> None:
    called = threading.Event()
    operation = robot.move_joints(LONG, wait=False)
    operation.when_done(called.set)
    with pytest.raises(MotionTimeoutError, match="it goes on"):
        operation.result(timeout=0.001)
    assert not operation.done
    wait_until(lambda: max(map(abs, robot.state.velocities)) > 0.01, "the arm moves")
    operation.cancel()
    assert operation.wait(10.0)
    assert called.wait(10.0)
    late = threading.Event()
    operation.when_done(late.set)
    assert late.is_set()
    assert operation.status is Status.CANCELLED
    assert isinstance(operation.error, MotionCancelledError)
    with pytest.raises(MotionCancelledError, match=r"interrupted .* s into the trajectory"):
        operation.result()
    operation.cancel()


@pytest.mark.parametrize("wait", [True, False])
def test_every_record_comes_before_the_end(robot: Any, wait: bool) -> None:
    records: list[CycleRecord] = []
    operation = robot.move_relative(z=0.004, on_cycle=records.append, wait=wait)
    operation.result(10.0)
    phases = [record.phase for record in records]
    assert phases[0] is Phase.TRAJECTORY
    assert phases[-1] is Phase.SETTLING
    starts = [record.start for record in records]
    assert max(b - a for a, b in itertools.pairwise(starts)) < 0.025


def test_records_that_arrive_as_a_wait_for_them_ends_are_passed_on() -> None:
    records: list[Any] = []
    goal = m.GoalValue(1, "home()", "one", Status.SUCCEEDED, 1.0)
    operation: RemoteOperation[None] = RemoteOperation(
        cast("Any", None), cast("Any", None), goal, records.append, observed=True
    )

    class Late(queue.SimpleQueue[Any]):
        """The last record and the end arrive when the first wait has just timed out."""

        def get(self, block: bool = True, timeout: float | None = None) -> Any:
            if not operation._over.is_set():
                operation.record(cast("Any", "the last one"))
                operation.take(goal)
                raise queue.Empty
            return super().get(block, timeout)

    operation._records = Late()
    operation.observe()
    assert operation.done
    assert records == ["the last one"]


@pytest.mark.parametrize("wait", [True, False])
def test_a_callback_that_raises_ends_the_motion_with_its_error(robot: Any, wait: bool) -> None:
    def raising(_: CycleRecord) -> None:
        raise ZeroDivisionError("of the callback")

    if wait:
        with pytest.raises(ZeroDivisionError, match="of the callback"):
            robot.move_joints(LONG, on_cycle=raising)
    else:
        operation = robot.move_joints(LONG, on_cycle=raising, wait=False)
        assert operation.wait(10.0)
        assert operation.status is Status.FAILED
        assert isinstance(operation.error, ZeroDivisionError)
        with pytest.raises(ZeroDivisionError, match="of the callback"):
            operation.result()
    assert not robot.is_moving
    assert not near(robot.state.positions, LONG)
    robot.move_joints(HALF)


def test_calls_in_a_callback_that_would_wait_for_it_are_refused(robot: Any) -> None:
    raised: list[BaseException] = []

    def inside(_: CycleRecord) -> None:
        if not raised:
            try:
                robot.move_joints(HALF)
            except BioscaraError as error:
                raised.append(error)

    robot.move_relative(z=0.004, on_cycle=inside)
    assert isinstance(raised[0], BusyError)


def test_jogs_move_as_their_velocities_say(robot: Any) -> None:
    before = robot.state.positions
    # Longer than the averages of a jog: one that ends before is still slow.
    left = [JointVelocity(0.2)] * 40
    robot.jog(lambda: left.pop() if left else None)
    assert robot.state.positions[0] > before[0] + 0.01
    height = robot.pose.z
    tool = [ToolVelocity(z=0.02)] * 8
    robot.jog(lambda: tool.pop() if tool else None)
    assert robot.pose.z > height
    operation = robot.jog(lambda: JointVelocity(0.05), wait=False)
    eventually(lambda: operation.status is Status.RUNNING)
    robot.stop()
    with pytest.raises(MotionCancelledError):
        operation.result(10.0)
    assert robot.jog(JointVelocity, wait=False, timeout=0.2).wait(10.0)


def test_a_jog_says_while_it_runs_and_afterwards_why_it_is_held(robot: Any) -> None:
    ended = False
    robot.move_joints((0.3, 0.2, 0.0, 0.0))
    outwards = ToolVelocity(0.05)
    operation = robot.jog(lambda: None if ended else outwards, wait=False)
    eventually(lambda: operation.limitation is not None and operation.limitation.held)
    expected = "x, y held: the elbow is straight; move inwards"
    assert str(operation.limitation) == expected
    assert operation.limitation.limit is JogLimit.STRETCHED
    ended = True
    operation.result(10.0)
    assert str(operation.limitation) == expected
    left = [JointVelocity(0.1)] * 20
    assert robot.jog(lambda: left.pop() if left else None).limitation is None


PLACE = 0.4, 0.2, 0.25, 0.0
NO_VELOCITIES: tuple[Any, ...] = (
    (0.1, 0.0, 0.0, 0.0), [0.1, 0.0, 0.0, 0.0], np.array([0.1, 0.0, 0.0, 0.0]), {"x": 0.1}, 1, "",
    False, (),
    np.array(None), Pose(0.1, 0.0, 0.0), ToolVelocity(math.nan), JointVelocity(0.1, None),  # type: ignore[arg-type]
)  # fmt: skip
NO_WAYPOINTS: tuple[Any, ...] = (
    PLACE, Pose(*PLACE), Waypoint(PLACE), Waypoint([*PLACE]), Waypoint(np.array(PLACE)),  # type: ignore[arg-type]
    Waypoint({"x": 0.4}), Waypoint(None), Waypoint(Pose(*PLACE), "lin"),  # type: ignore[arg-type]
    Waypoint(Pose(math.nan, 0.2, 0.25)), Waypoint(Pose(*PLACE), Motion.CIRC, via=PLACE),  # type: ignore[arg-type]
)  # fmt: skip


def test_velocities_and_waypoints_are_refused_as_by_a_robot_of_this_process(arm: Arm) -> None:
    before = arm.own.state.positions

    def refusal(robot: Any, kind: str, value: object) -> tuple[type[Exception], str]:
        left = [value] * 20
        with pytest.raises(InvalidArgumentError) as refused:
            robot.move_sequence([value]) if kind == "waypoint" else robot.jog(
                lambda: left.pop() if left else None
            )
        return refused.type, str(refused.value)

    for kind, values in (("velocity", NO_VELOCITIES), ("waypoint", NO_WAYPOINTS)):
        for value in values:
            with entry(repr(value)):
                assert refusal(arm.robot, kind, value) == refusal(arm.own, kind, value)
                assert arm.own.state.positions == pytest.approx(before, abs=1e-4)
    for made in (m.Jog, lambda **given: m.SetJogVelocity(goal=1, **given)):
        for given in ({"tool": PLACE}, {"joints": PLACE}, {"tool": JointVelocity(0.1)}):
            with pytest.raises(InvalidArgumentError, match=r"; give (Tool|Joint)Velocity$"):
                made(**given)


def test_a_jog_whose_source_raises_ends_with_that(robot: Any) -> None:
    def source() -> JointVelocity:
        raise ZeroDivisionError("of the source")

    with pytest.raises(ZeroDivisionError, match="of the source"):
        robot.jog(source)
    for velocity in ("fast", JointVelocity(math.nan), 3):
        with pytest.raises(InvalidArgumentError):
            robot.jog(lambda given=velocity: given)
    assert not robot.is_moving
    robot.move_joints(HALF)


def test_the_jaws_move_grasp_and_release(robot: Any) -> None:
    jaws = robot.gripper
    assert math.isnan(jaws.width)
    jaws.enable()
    result = jaws.move(0.06).result()
    assert result.position == pytest.approx(0.06)
    assert result.reached_goal
    assert not result.stalled
    assert jaws.width == pytest.approx(0.06)
    assert jaws.widths == (pytest.approx(0.06), pytest.approx(0.06))
    assert jaws.open(wait=False).result(10.0).position == robot.parameters.gripper.upper
    assert jaws.grasp(PLATE, 0.08, squeeze=0.004).result().position == pytest.approx(0.076)
    assert robot.load == PLATE
    with pytest.raises(LifecycleError):
        jaws.move(0.06)
    jaws.release(0.005)
    assert robot.load is None
    assert jaws.width == pytest.approx(0.085)
    jaws.close()
    jaws.disable()
    assert math.isnan(jaws.width)
    assert "not driven" in repr(jaws)


def test_the_present_position_is_taught_and_found_again(robot: Any) -> None:
    taught = robot.teach("gate")
    assert taught.joints == pytest.approx(HALF, abs=2e-3)
    assert taught in robot.table.poses
    with pytest.raises(InvalidArgumentError, match=r"there is a pose gate already; .*overwrite"):
        robot.teach("gate")
    robot.move_joints((0.4, *HALF[1:]))
    assert robot.teach("gate", overwrite=True).joints.j1 == pytest.approx(0.4, abs=2e-3)
    robot.move_joints(HALF)
    motion = robot.move_named("gate")
    assert robot.state.positions[0] == pytest.approx(0.4, abs=2e-3)
    assert all("times as long" in note for note in motion.notes)
    assert robot.warnings == ()


def test_the_workspace_comes_back_as_it_was_set(robot: Any) -> None:
    scene = Scene(
        (
            Box("room", (-2.0, -2.0, -1.0), (2.0, 2.0, 2.0), yaw=0.1, keep_in=True),
            Cylinder("tube", 2.0, 2.0, 0.1, 0.0, 1.0, links=("link_3",)),
        ),
        table_height=-0.5,
        margin=0.004,
    )
    robot.scene = scene
    assert robot.scene.zones == scene.zones
    assert (robot.scene.table_height, robot.scene.margin) == (-0.5, 0.004)
    frame = Frame("bench", Pose(0.3, 0.1, 0.02, 0.5))
    table = robot.table.with_frame(frame).with_pose(NamedPose("plate", Joints(*HALF)))
    table = table.with_tool(Tool("needle", Pose(0.0, 0.0, -0.05, 0.0), 0.1))
    robot.table = table
    assert robot.table == table
    assert robot.frames == (frame,)
    assert robot.frame("bench") == frame
    robot.tool = "needle"
    assert robot.tool == table.tool("needle")
    robot.move_named("plate")
    assert robot.plan.workspace.tool.name == "needle"
    robot.tool = robot.table.tools[0] if robot.table.tools[0].name != "needle" else "fingers"
    robot.reduced_speed = False
    assert robot.reduced_speed is False
    robot.speed_override = 0.5
    assert robot.speed_override == 0.5
    robot.attach(PLATE)
    assert robot.load == PLATE
    with pytest.raises(LifecycleError):
        robot.attach(PLATE)
    robot.detach()
    assert robot.load is None


def test_faults_are_acknowledged_recovered_and_the_arm_enabled_again(arm: Arm) -> None:
    robot = arm.robot
    operation = robot.move_joints(LONG, wait=False)
    eventually(lambda: operation.progress > 0.1)
    arm.fail("power", "j4", 0.0)
    try:
        with pytest.raises(BioscaraError):
            operation.result(10.0)
        assert operation.status is Status.FAILED
        lost_power_is_recovered_from(arm)
    finally:
        arm.fail("power", "j4", 1.0)


def lost_power_is_recovered_from(arm: Arm) -> None:
    robot = arm.robot
    eventually(lambda: robot.faults)
    fault = robot.faults[0]
    assert isinstance(fault.kind, FaultKind)
    assert fault.source == "j4"
    assert isinstance(fault.cause, BioscaraError)
    with pytest.raises((FaultedError, NotHomedError)):
        robot.move_joints(HALF)
    with pytest.raises(FaultedError):
        robot.enable()
    arm.fail("power", "j4", 1.0)
    with pytest.raises(FaultedError, match="acknowledge"):
        robot.recover()
    assert robot.acknowledge()[0].kind is fault.kind
    robot.recover()
    assert robot.faults == ()
    robot.enable()
    assert robot.is_enabled
    assert not robot.is_homed
    robot.disable()
    assert not robot.is_enabled


@pytest.mark.parametrize("how", ["wait=True", "on_cycle", "result", "jog"])
def test_ctrl_c_brings_the_arm_to_rest(
    robot: Any, how: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Python drops an exception that a signal raises in a finalizer or a weak reference's callback.
    dropped: list[type[BaseException]] = []
    monkeypatch.setattr(sys, "unraisablehook", lambda raised: dropped.append(raised.exc_type))

    def interrupt(ended: threading.Event) -> None:
        eventually(lambda: robot.is_moving)
        os.kill(os.getpid(), signal.SIGINT)
        while not ended.wait(5.0):
            os.kill(os.getpid(), signal.SIGINT)

    def moving() -> None:
        if how == "result":
            robot.move_joints(LONG, wait=False).result()
        elif how == "jog":
            robot.jog(lambda: JointVelocity(0.02))
        else:
            robot.move_joints(LONG, on_cycle=id if how == "on_cycle" else None)

    def interrupted() -> bool:
        ended = threading.Event()
        with ExitStack() as stack:
            thread = threading.Thread(target=interrupt, args=(ended,))
            stack.callback(thread.join)
            stack.callback(ended.set)
            thread.start()
            try:
                moving()
            except KeyboardInterrupt:
                return True
        return False

    while not interrupted():
        assert dropped
        assert set(dropped) == {KeyboardInterrupt}
        dropped.clear()
        robot.move_joints(HALF)
    if how == "result":
        eventually(lambda: not robot.is_moving)
    assert not robot.is_moving
    assert not near(robot.state.positions, LONG)
    robot.move_joints(HALF)


def test_a_closed_robot_refuses_to_move_and_can_be_closed_again(arm: Arm) -> None:
    robot = arm.robot
    with pytest.raises(LifecycleError):
        robot.open()
    robot.close()
    robot.close()
    assert robot.shutdown() == []
    for call in (
        lambda: robot.move_joints(HALF),
        lambda: robot.state,
        robot.gripper.open,
        robot.enable,
    ):
        with pytest.raises(NotInitializedError):
            call()
    assert not robot.is_enabled
    assert not robot.is_moving
    assert "closed" in repr(robot)
    with pytest.raises(LifecycleError):
        robot.open()


def test_asyncio_takes_a_handle_as_a_coroutine(arm: Arm) -> None:
    async def program(remote: RemoteRobot) -> None:
        async with remote as robot, asyncio.TaskGroup() as group:
            moved = group.create_task(robot.move_joints(LONG, wait=False))
            opened = group.create_task(robot.gripper.open(wait=False))
            await asyncio.gather(moved, opened)
            assert near(robot.state.positions, LONG)
            assert opened.result().reached_goal
            going = asyncio.create_task(robot.move_joints(HALF, wait=False))
            await asyncio.sleep(0.0)
            going.cancel()
            with pytest.raises(asyncio.CancelledError):
                await going
            assert not robot.is_moving
            with pytest.raises(InvalidArgumentError, match="above zero"):
                await anext(robot.states(0.0))
            states = robot.states(0.001)
            assert [(await anext(states)).names for _ in range(3)] == [NAMES] * 3

    robot = RemoteRobot(NAME)
    asyncio.run(program(robot))
    assert not robot.is_open
