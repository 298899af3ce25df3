"""Under any controller, the arm keeps clear of zones, table and itself."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from bioscara.control.controllers.controller import Controller
from bioscara.control.controllers.forward_command_controller import ForwardCommandController
from bioscara.control.controllers.jog_controller import JogController
from bioscara.control.controllers.joint_trajectory import (
    ErrorCode,
    Goal,
    GoalHandle,
    GoalStatus,
    JointTrajectory,
    JointTrajectoryController,
    Point,
)
from bioscara.control.limits.averaging import Smoothing
from bioscara.control.limits.collision_guard import CollisionGuard
from bioscara.control.limits.tool_speed import ToolSpeedCap
from bioscara.control.manager.registry import TYPES
from bioscara.model import JointParameters
from bioscara.planning.collision.scene import Box, Scene
from bioscara.planning.collision.swept import SLACK
from bioscara.planning.motions.jog import JogGenerator, JointVelocity, ToolVelocity
from bioscara.robot import kinematics_of
from bioscara.robot.workspace.workspace import Workspace
from control.control_stack import BOTH, NAMES, PARAMETERS, World
from control.scripted_controller import WildParameters
from planning.sampled_contact import touched
from planning.scenes import COUNT, random_joints, random_scene

Array = npt.NDArray[np.float64]
ARM = kinematics_of(PARAMETERS)
# Driven to and fro at its full acceleration, j3 loses its reference under any controller.
JOINTS = [
    replace(joint, max_acceleration=0.5 * joint.max_acceleration) for joint in PARAMETERS.joints
]
START = (0.3, 0.2, 0.8, -0.5)
BEYOND = (1.5, 0.2, 0.8, -0.5)
FREE = Scene()
FULL_SPEED = Workspace.of(PARAMETERS, reduced_speed=False).raw_windows
WALL = Scene((Box("wall", (-0.2, 0.62, 0.0), (0.6, 0.9, 0.6)),))
KINDS: Mapping[str, tuple[tuple[str, Sequence[str]], ...]] = {
    "position": (("position", NAMES),),
    "velocity": (("velocity", NAMES),),
    "both": (("both", NAMES),),
    "mixed": (("position", NAMES[:2]), ("velocity", NAMES[2:])),
}


class Raw(Controller[WildParameters]):
    """Commands positions and velocities of all joints together, raw."""

    TYPE = "test/Raw"
    PARAMETERS = WildParameters
    values: Sequence[float] = ()

    @property
    def command_interfaces(self) -> tuple[str, ...]:
        return tuple(f"{name}/{kind}" for kind in BOTH for name in NAMES)

    def on_activate(self, time: float) -> None:
        self.values = [handle.value for handle in self.command_handles]

    def update(self, time: float, period: float) -> None:
        for handle, value in zip(self.command_handles, self.values, strict=True):
            handle.value = value


TYPES[Raw.TYPE] = Raw


class Guarded:
    """A world whose limiter keeps the arm clear of a scene, which may change at any time."""

    def __init__(
        self,
        scene: Scene,
        at: Sequence[float] | None = START,
        *,
        guarded: bool = True,
        home: bool = True,
        speed: float = math.inf,
        windows: tuple[float, ...] = (),
        joints: Sequence[JointParameters] = JOINTS,
    ) -> None:
        place = None if at is None else dict(zip(NAMES, at, strict=True))
        self.world = World(at=place, joints=joints, home=home)
        manager = self.world.manager
        self.joints = tuple(manager.limiter.joints.values())
        cap = ToolSpeedCap(self.joints, ARM.tool_speed, speed)
        smoothing = Smoothing(self.joints, manager.rate)
        smoothing.windows = windows
        self.clearance = CollisionGuard(self.joints, ARM, scene, smoothing, manager.warnings)
        manager.limiter.stages = (cap, self.clearance, smoothing) if guarded else (cap,)

    @property
    def scene(self) -> Scene:
        return self.clearance.scene

    @scene.setter
    def scene(self, scene: Scene) -> None:
        self.clearance.scene = scene

    @property
    def here(self) -> list[float]:
        return [joint.here for joint in self.joints]

    @property
    def stops(self) -> list[str]:
        return [text for text in self.world.manager.warnings if "was stopped" in text]

    def forward(self, interface: str, joints: Sequence[str] = NAMES) -> ForwardCommandController:
        name = f"{interface} of {len(joints)}"
        controllers = {each.name: each for each in self.world.manager.controllers}
        forward = controllers.get(name) or self.world.load(
            name, ForwardCommandController.TYPE, joints=tuple(joints), interface_name=interface
        )
        assert isinstance(forward, ForwardCommandController)
        return forward

    def stream(self, interface: str, values: Sequence[float]) -> ForwardCommandController:
        forward = self.forward(interface)
        self.world.switch(forward.name)
        forward.command(values)
        return forward

    def follow(
        self, goal: Sequence[float], seconds: float, *, collision_checked: bool
    ) -> tuple[JointTrajectoryController, GoalHandle]:
        controller = self.world.load(
            "jtc",
            JointTrajectoryController.TYPE,
            joints=NAMES,
            command_interfaces=BOTH,
            state_interfaces=BOTH,
            constraints={
                "decelerate_on_cancel": True,
                **{
                    joint.name: {"max_deceleration_on_cancel": joint.max_acceleration}
                    for joint in JOINTS
                },
            },
        )
        assert isinstance(controller, JointTrajectoryController)
        self.world.switch("jtc")
        return controller, controller.send_goal(
            self.goal(goal, seconds, collision_checked=collision_checked), self.now
        )

    def goal(self, goal: Sequence[float], seconds: float, *, collision_checked: bool) -> Goal:
        zero = (0.0,) * 4
        points = (Point(0.0, tuple(self.here), zero, zero), Point(seconds, tuple(goal), zero, zero))
        trajectory = JointTrajectory(NAMES, points)
        return Goal(trajectory, collision_checked=True) if collision_checked else Goal(trajectory)

    @property
    def now(self) -> float:
        return self.world.clock.now()

    def run(self, cycles: int) -> Array:
        """Return the commanded positions of the joints, before and after each cycle."""
        rows = [self.here]
        for _ in range(cycles):
            self.world.loop.step()
            rows.append(self.here)
        assert not self.world.supervisor.faults
        return np.array(rows)

    def measured(self) -> list[float]:
        return [axis.position.value for axis in self.world.hardware.axes]


def dense(rows: Array) -> Array:
    between = np.linspace(0.0, 1.0, 4)[:-1, None, None]
    return (rows[:-1] + between * np.diff(rows, axis=0)).reshape(-1, 4)


def require_gentle(rows: Array) -> None:
    """No joint is commanded beyond its limits."""
    period = 0.01
    speeds = np.diff(rows, axis=0) / period
    changes = np.abs(np.diff(speeds, axis=0)) / period
    for joint, limit in enumerate(JOINTS):
        assert changes[:, joint].max() <= limit.max_acceleration * (1.0 + 1e-4)
        # It begins where the joint was measured, which may be an encoder's count beyond a limit.
        assert rows[:, joint].min() >= min(limit.lower, rows[0, joint]) - 1e-9
        assert rows[:, joint].max() <= max(limit.upper, rows[0, joint]) + 1e-9


def raw_values(forward: Raw | ForwardCommandController, rng: np.random.Generator) -> list[float]:
    """Return random setpoints of the type that a controller commands."""
    goal = dict(zip(NAMES, random_joints(rng), strict=True))
    if isinstance(forward, Raw):
        share = rng.uniform(-1.0, 1.0)
        return [*goal.values(), *(share * joint.max_velocity for joint in JOINTS)]
    joints = [JOINTS[NAMES.index(name)] for name in forward.parameters.joints]
    if forward.parameters.interface_name == "position":
        return [goal[joint.name] for joint in joints]
    return [rng.uniform(-1.0, 1.0) * joint.max_velocity for joint in joints]


@pytest.mark.parametrize(
    ("kind", "windows"),
    [
        *((kind, FULL_SPEED) for kind in KINDS),
        *((kind, (0.23, 0.107)) for kind in ("position", "both", "mixed")),
        # Velocities that are not averaged may stall j3, and positions that follow from them.
        *((kind, ()) for kind in ("position", "both")),
    ],
)
def test_no_sample_of_a_random_stream_is_inside_the_margin(
    kind: str, windows: tuple[float, ...]
) -> None:
    rng = np.random.default_rng(17)
    tried, interventions, per_scene = 0, 0, 6

    def fresh() -> tuple[Guarded, list[Raw | ForwardCommandController]]:
        guarded = Guarded(FREE, windows=windows)
        forwards: list[Raw | ForwardCommandController] = []
        for interface, joints in KINDS[kind]:
            if interface == "both":
                both = guarded.world.load("both", Raw.TYPE)
                assert isinstance(both, Raw)
                forwards.append(both)
            else:
                forwards.append(guarded.forward(interface, joints))
        return guarded, forwards

    guarded, forwards = fresh()
    names = tuple(each.name for each in forwards)
    while tried < COUNT // 3:
        scene = random_scene(rng)
        here = guarded.measured()
        if scene.clearance(ARM, [here])[0] < scene.margin + 2.0 * SLACK:
            if FREE.clearance(ARM, [here])[0] < FREE.margin + 2.0 * SLACK:
                # It rests in front of itself: no scene would do.
                interventions += guarded.clearance.interventions
                guarded, forwards = fresh()
            continue
        guarded.scene = scene
        guarded.world.switch(*names)
        for _ in range(per_scene):
            tried += 1
            for forward in forwards:
                values = raw_values(forward, rng)
                if isinstance(forward, Raw):
                    forward.values = values
                else:
                    forward.command(values)
            rows = guarded.run(int(rng.integers(5, 50)))
            assert scene.clearance(ARM, dense(rows)).min() >= scene.margin - 1e-9
            assert not touched(ARM, scene.zones, guarded.here)
            if kind in {"position", "both"}:
                require_gentle(rows)
        guarded.world.switch("hold", off=names)
        rows = guarded.run(150)
        assert scene.clearance(ARM, dense(rows)).min() >= scene.margin - 1e-9
        assert scene.clearance(ARM, [guarded.measured()])[0] >= scene.margin - 2e-3
        guarded.world.switch(off=("hold",))
    assert interventions + guarded.clearance.interventions > tried


@pytest.mark.parametrize("scene", [FREE, WALL])
@pytest.mark.parametrize("interface", ["position", "velocity"])
def test_a_stream_that_is_clear_passes_bit_for_bit(interface: str, scene: Scene) -> None:
    runs = []
    for guarded in (True, False):
        arm, rng = Guarded(scene, guarded=guarded), np.random.default_rng(4)
        forward = arm.stream(interface, START if interface == "position" else [0.0] * 4)
        rows = []
        for _ in range(12):
            way = rng.uniform(-0.1, 0.1, 4) * [1.0, 0.3, 1.0, 1.0]
            forward.command((way + START if interface == "position" else way).tolist())
            rows.append(arm.run(25))
        assert arm.clearance.interventions == 0
        runs.append(np.concatenate(rows))
    assert np.array_equal(*runs)


def test_an_unverified_trajectory_ends_in_front_of_a_zone() -> None:
    arm = Guarded(WALL)
    controller, goal = arm.follow(BEYOND, 4.0, collision_checked=False)
    rows = arm.run(400)
    assert WALL.clearance(ARM, dense(rows)).min() >= WALL.margin
    assert goal.status is GoalStatus.ABORTED
    assert goal.error_code is ErrorCode.PATH_TOLERANCE_VIOLATED
    assert goal.text == ("jtc was stopped: jaws would come nearer to wall than the margin of 5 mm")
    assert arm.stops == [goal.text]
    assert np.array_equal(rows[-1], rows[-100])
    require_gentle(rows)
    assert WALL.clearance(ARM, [arm.measured()])[0] < 0.05
    back = controller.send_goal(arm.goal(START, 3.0, collision_checked=False), arm.now)
    arm.run(320)
    assert back.status is GoalStatus.SUCCEEDED


@pytest.mark.parametrize("windows", [(), FULL_SPEED, (0.23, 0.107)])
@pytest.mark.parametrize("late", [2, 10, 20])
def test_a_stop_that_another_controller_takes_over_ends_no_nearer(
    windows: tuple[float, ...], late: int
) -> None:
    for number in range(4):
        arm = Guarded(WALL, (START[0] - 0.0023 * number, *START[1:]), windows=windows)
        forward = arm.stream("position", BEYOND)
        arm.world.run_until(lambda arm=arm: arm.clearance.interventions >= late, 4.0)
        arm.world.switch("hold", off=(forward.name,))
        rows = arm.run(150)
        assert WALL.clearance(ARM, dense(rows)).min() >= WALL.margin - 1e-9


def test_a_stop_that_hold_takes_over_ends_at_the_same_place_at_any_time() -> None:
    ends = []
    for late in (2, 10, 20):
        arm = Guarded(WALL)
        forward = arm.stream("position", BEYOND)
        arm.world.run_until(lambda arm=arm, late=late: arm.clearance.interventions >= late, 4.0)
        arm.world.switch("hold", off=(forward.name,))
        ends.append(arm.run(150)[-1])
    assert np.ptp(ends, axis=0).max() < 1e-6


def test_a_swept_trajectory_is_not_checked_again() -> None:
    runs = []
    for guarded in (True, False):
        # Through the zone: a trajectory marked as collision-checked is not checked again.
        arm = Guarded(WALL, guarded=guarded)
        _, goal = arm.follow(BEYOND, 4.0, collision_checked=True)
        runs.append(arm.run(450))
        assert goal.status is GoalStatus.SUCCEEDED
        assert arm.clearance.interventions == 0
    assert np.array_equal(*runs)


def test_a_ramp_along_a_wall_after_a_cancel_is_not_braked() -> None:
    runs = []
    for guarded in (True, False):
        arm = Guarded(WALL, guarded=guarded)
        controller, _ = arm.follow(BEYOND, 3.0, collision_checked=True)
        rows = [arm.run(120)]
        controller.cancel(arm.now)
        rows.append(arm.run(100))
        assert arm.clearance.interventions == 0
        runs.append(np.concatenate(rows))
    assert np.array_equal(*runs)


def slide(arm: Guarded, velocities: Callable[[int], ToolVelocity], cycles: int) -> Array:
    jog = arm.world.load("jog", JogController.TYPE, joints=NAMES, command_interfaces=BOTH)
    assert isinstance(jog, JogController)
    jog.jog = JogGenerator(ARM, JOINTS, arm.here, arm.scene)
    arm.world.switch("jog")
    rows = []
    for cycle in range(cycles):
        jog.command(velocities(cycle), arm.now)
        rows.append(arm.run(1)[-1])
    return np.array(rows)


def test_a_jog_along_a_wall_and_the_hold_after_it_are_not_braked() -> None:
    arm = Guarded(WALL)
    rows = slide(arm, lambda cycle: ToolVelocity(y=0.2 if cycle < 150 else 0.0, x=-0.1), 260)
    assert WALL.clearance(ARM, rows).min() < WALL.margin + 1e-3
    arm.world.switch("hold", off=("jog",))
    arm.run(100)
    assert arm.clearance.interventions == 0


def test_hold_takes_over_from_a_stream_that_had_room_to_stop() -> None:
    for cycles in range(20, 160, 10):
        arm = Guarded(WALL, speed=0.5)
        arm.stream("position", BEYOND)
        arm.run(cycles)
        arm.world.switch("hold", off=("position of 4",))
        rows = arm.run(150)
        assert WALL.clearance(ARM, dense(rows)).min() >= WALL.margin
        assert np.array_equal(rows[-1], rows[-20])
        require_gentle(rows)


@pytest.mark.parametrize("windows", [(), FULL_SPEED, (0.23, 0.107)])
@pytest.mark.parametrize("late", [3, 8, 13])
def test_hold_takes_over_from_velocities_that_are_being_stopped(
    windows: tuple[float, ...], late: int
) -> None:
    arm = Guarded(WALL, windows=windows)
    forward = arm.stream("velocity", (1.0, 0.0, 0.0, 8.0))
    arm.world.run_until(lambda: arm.clearance.interventions >= late, 4.0)
    speeds = np.array([joint.state[1] for joint in arm.joints])
    assert abs(speeds[3]) > 0.5
    arm.world.switch("hold", off=(forward.name,))
    rows = arm.run(150)
    # Under velocity control a joint lags: it continues from where it is, not where it should be.
    changes = np.abs(np.diff(rows, axis=0)[0] / 0.01 - speeds) / 0.01
    assert (changes <= [joint.max_acceleration * (1.0 + 1e-4) for joint in JOINTS]).all()
    require_gentle(rows)
    assert WALL.clearance(ARM, dense(rows)).min() >= WALL.margin


def test_velocities_towards_an_obstacle_stall_no_motor() -> None:
    # Stops and starts in step with the belt of j3, each with all of its acceleration, stalled it.
    rng = np.random.default_rng(1)
    for _ in range(4):
        arm = Guarded(FREE, windows=FULL_SPEED, joints=PARAMETERS.joints)
        velocities = [rng.uniform(-1.0, 1.0) * joint.max_velocity for joint in PARAMETERS.joints]
        arm.stream("velocity", velocities)
        arm.run(500)


def test_a_small_step_at_full_speed_stalls_no_motor() -> None:
    # It accelerates and brakes for half a period of j3's belt each.
    arm = Guarded(FREE, windows=FULL_SPEED, joints=PARAMETERS.joints)
    arm.stream("position", (*START[:2], START[2] + 0.0248, START[3]))
    rows = arm.run(60)
    assert rows[-1, 2] == pytest.approx(START[2] + 0.0248, abs=1e-9)


@pytest.mark.parametrize("late", [3, 7, 11])
@pytest.mark.parametrize("windows", [(0.23, 0.107), FULL_SPEED])
def test_averages_of_late_cycles_keep_to_the_limits(windows: tuple[float, ...], late: int) -> None:
    for bound in ("upper", "lower"):
        arm = Guarded(FREE, (0.3, 0.2, 0.0, 0.0), windows=windows)
        arm.stream("position", (0.3, 0.2, 0.0, getattr(JOINTS[3], bound)))
        for cycle in range(200):
            if cycle == late:
                arm.world.arm.run(0.01)
            rows = arm.run(1)
        assert rows[-1, 3] == pytest.approx(getattr(JOINTS[3], bound), abs=1e-3)


@pytest.mark.parametrize("windows", [(0.23, 0.107), FULL_SPEED])
@pytest.mark.parametrize("interfaces", ["position", "both"])
def test_averages_of_late_cycles_end_where_they_were_commanded(
    windows: tuple[float, ...], interfaces: str
) -> None:
    arm, rng = Guarded(FREE, windows=windows), np.random.default_rng(3)
    if interfaces == "both":
        stream = arm.world.load("both", Raw.TYPE)
        arm.world.switch("both")
    else:
        stream = arm.stream("position", START)
    for _ in range(10):
        goal = np.array(START) + rng.uniform(-0.05, 0.05, 4) * (1.0, 0.1, 1.0, 1.0)
        if isinstance(stream, Raw):
            stream.values = [*goal, *(0.0,) * 4]
        else:
            stream.command(list(goal))
        rows = []
        for _ in range(130):
            if rng.random() < 0.2:
                arm.world.arm.run(0.008)
            rows.append(arm.run(1)[-1])
        assert rows[-1] == pytest.approx(goal, abs=2e-8)


@pytest.mark.parametrize("windows", [(0.23, 0.107), FULL_SPEED])
def test_a_stream_may_continue_before_the_hold_has_ended(windows: tuple[float, ...]) -> None:
    # Its average goes on for half the windows: begun in motion, it ended inside the margin.
    for cycles, held in itertools.product(range(30, 150, 30), (1, 4, 12)):
        arm = Guarded(WALL, windows=windows)
        arm.stream("position", BEYOND)
        arm.run(cycles)
        arm.world.switch("hold", off=("position of 4",))
        rows = [arm.run(held)]
        arm.world.switch("position of 4", off=("hold",))
        arm.forward("position").command(BEYOND)
        rows.append(arm.run(200))
        assert WALL.clearance(ARM, dense(np.concatenate(rows))).min() >= WALL.margin, (cycles, held)


def test_jog_takes_over_from_a_stream_towards_a_wall() -> None:
    arm = Guarded(WALL)
    arm.stream("position", BEYOND)
    arm.run(60)
    jog = arm.world.load("jog", JogController.TYPE, joints=NAMES, command_interfaces=BOTH)
    assert isinstance(jog, JogController)
    jog.jog = JogGenerator(ARM, JOINTS, arm.here, arm.scene)
    arm.world.switch("jog", off=("position of 4",))
    jog.command(JointVelocity(), arm.now)
    rows = arm.run(150)
    assert WALL.clearance(ARM, dense(rows)).min() >= WALL.margin


def test_a_stream_that_returns_moves_the_arm_again() -> None:
    arm = Guarded(WALL, speed=0.25)
    forward = arm.stream("position", START)
    for cycle in range(600):
        share = math.sin(2.0 * math.pi * cycle / 600.0)
        swing = zip(START, (1.2, 0.02, 0.4, 0.8), strict=True)
        forward.command([place + share * way for place, way in swing])
        arm.run(1)
    assert arm.clearance.interventions > 50
    forward.command(START)
    assert np.allclose(arm.run(500)[-1], START)


def test_a_stop_ends_where_joints_are_released() -> None:
    arm = Guarded(WALL)
    forward = arm.stream("velocity", (1.0, 0.0, 0.0, 2.0))
    arm.world.run_until(lambda: arm.clearance.interventions > 0)
    arm.world.switch(off=(forward.name,))
    arm.run(30)
    arm.world.switch(forward.name)
    arm.run(1)
    # Alone, the quick joint came to rest long before the stop of all would have ended.
    assert abs(arm.joints[3].speed) < 0.2


def test_a_joint_that_was_released_and_is_claimed_again_stays_where_it_is() -> None:
    arm = Guarded(FREE, windows=(0.23, 0.107))
    # This one stays active: the setpoints are an average all the time.
    arm.world.switch(arm.forward("position", NAMES[:1]).name)
    turning = arm.forward("velocity", NAMES[2:])
    arm.world.switch(turning.name)
    turning.command((0.8, 0.0))
    arm.run(100)
    arm.world.switch(off=(turning.name,))
    arm.run(100)
    came_to_rest = arm.measured()[2]
    arm.world.switch(arm.forward("position", NAMES[2:]).name)
    assert np.abs(arm.run(20)[:, 2] - came_to_rest).max() < 1e-3


def test_a_stream_that_goes_on_towards_a_zone_is_reported_once() -> None:
    arm = Guarded(WALL)
    forward = arm.stream("position", BEYOND)
    rows = arm.run(600)
    stood = arm.clearance.interventions
    assert stood > 100
    assert arm.stops == [
        "position of 4 was stopped: jaws would come nearer to wall than the margin of 5 mm"
    ]
    forward.command(START)
    assert np.allclose(arm.run(300)[-1], START)
    assert WALL.clearance(ARM, dense(rows)).min() >= WALL.margin
    forward.command(BEYOND)
    arm.run(300)
    assert len(arm.stops) == 2


def test_from_home_a_stream_unfolds_the_arm_without_self_collision() -> None:
    arm = Guarded(FREE, at=None)
    j1, j2, j3, j4 = home = arm.measured()
    assert FREE.clearance(ARM, [home])[0] > FREE.margin
    forward = arm.stream("position", home)
    forward.command((j1, j2, j3, 1.5))
    rows = arm.run(300)
    assert arm.clearance.interventions > 50
    assert "would come nearer to link_1 than the margin of 5 mm" in arm.stops[0]
    for goal in (j1, j2, j3, j4), (-2.0, j2, j3, j4), (-2.0, j2, 1.5, j4), (-2.0, j2, 1.5, 1.5):
        forward.command(goal)
        passed = arm.run(400)
        assert passed[-1] == pytest.approx(goal, abs=1e-3)
        rows = np.concatenate((rows, passed))
    assert FREE.clearance(ARM, dense(rows)).min() >= FREE.margin


def test_where_a_joint_is_unknown_nothing_moves() -> None:
    arm = Guarded(WALL, at=None, home=False)
    # The cap on the tool's speed alone would do; so it must be off.
    arm.world.manager.limiter.stages = (arm.clearance,)
    arm.world.joint("j1").home()
    arm.world.loop.restart()
    arm.run(2)
    before = arm.measured()[0]
    forward = arm.forward("position", ("j1",))
    arm.world.switch(forward.name)
    forward.command([0.0])
    arm.run(50)
    assert arm.measured()[0] == pytest.approx(before, abs=1e-3)
    assert arm.stops == [
        "position of 1 was stopped: the position of j2, j3, j4 is unknown; home it first"
    ]


def test_a_zone_that_is_added_counts_at_once() -> None:
    arm = Guarded(FREE, speed=0.2)
    arm.stream("position", BEYOND)
    arm.run(60)
    assert arm.clearance.interventions == 0
    arm.scene = WALL
    rows = arm.run(300)
    assert WALL.clearance(ARM, dense(rows)).min() >= WALL.margin
    assert arm.clearance.interventions > 10
