"""Every remedy that an error names is followed, and gets the caller further.

Each row of :data:`REMEDIES` provokes an error, follows its message, and repeats the call.
The table in docs/errors.md has the same rows.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from bioscara import (
    Box,
    Load,
    Pose,
    Prism,
    Robot,
    Scene,
    errors as e,
)
from bioscara.api import messages as m
from bioscara.api.runtime import OwnerClaim
from bioscara.kinematics import Joints
from bioscara.planning import point_to_point
from bioscara.planning.files.scene_file import read_scene
from bioscara.sim import Bench
from served import HALF, NAME, RawClient, arm_served, eventually, own_robot
from simulated import ARM, NAMES, NEAR, simulated_bus

DOCUMENT = Path(__file__).parents[2] / "docs/errors.md"
FOLDED = Joints(-3.04568, 0.33792, 2.62565, 3.00842)
"""Where homing ends."""
PLATE = Load("plate", Prism.between((-0.02, -0.03, -0.02), (0.02, 0.03, 0.0)))
GOAL = Joints(-1.5, 0.2, 0.8, -0.5)


class World:
    """An arm with a person next to it.

    Attributes:
        robot: The arm.
        bench: The faults that can be simulated.
        evidence: Folder of its flight records.
        others: Other clients of its owner.
    """

    def __init__(self, robot: Any, evidence: Path) -> None:
        self.robot, self.evidence = robot, evidence
        self.others: list[RawClient] = []

    @property
    def bench(self) -> Bench:
        bench: Bench = self.robot.bus.bench
        return bench

    def fail(self, fault: str, joint: str = "", value: float = 1.0) -> None:
        """Let the arm fail, and notice it in a motion."""
        self.bench.apply(fault, joint, value)
        with suppress(e.BioscaraError):
            self.robot.move_relative(z=0.02, velocity_scaling=0.2)

    def move(self) -> None:
        self.robot.move_relative(z=0.01 if self.robot.pose.z < 0.2 else -0.01)


@contextmanager
def world(
    folder: Path, *, homed: bool = True, at: tuple[float, ...] = HALF, fed: bool = False
) -> Iterator[World]:
    evidence = folder / "faults"
    where = at if homed else tuple(NEAR.values())
    bus = simulated_bus(seed=2, homed=homed, at=where, controllers_fed=fed)
    robot = own_robot(evidence, arm=bus.arm)
    with robot:
        robot.enable()
        yield World(robot, evidence)


class Remedy(NamedTuple):
    """An error and its remedy.

    Attributes:
        when: What provokes it, for the table.
        error: Its class.
        says: The remedy in its message.
        provoke: Raises it.
        follow: Carries the remedy out; None where that is to make another call.
        then: The call that works afterwards; by default the refused one.
        at: Where the arm stands; None for an arm that is not homed.
        fed: Whether its controllers stay on without the arm's supply.
    """

    when: str
    error: type[Exception]
    says: str
    provoke: Callable[[World], object]
    follow: Callable[[World], object] | None = None
    then: Callable[[World], object] | None = None
    at: tuple[float, ...] | None = HALF
    fed: bool = False


def check(remedy: Remedy, w: World) -> None:
    """Provoke an error, follow its remedy, and require that this gets further."""
    with pytest.raises(remedy.error, match=re.escape(remedy.says)):
        remedy.provoke(w)
    if remedy.follow is not None:
        remedy.follow(w)
    (remedy.then or remedy.provoke)(w)


def failed(fault: str, joint: str = "", value: float = 1.0) -> Callable[[World], object]:
    """Return what wants to move an arm that has failed."""

    def provoke(w: World) -> None:
        w.fail(fault, joint, value)
        w.move()

    return provoke


def repaired(*, home: bool = False) -> Callable[[World], object]:
    """Return what ends all causes, acknowledges and recovers, and homes joints that need it."""

    def follow(w: World) -> None:
        w.bench.apply("clear")
        w.robot.acknowledge()
        w.robot.recover()
        if home:
            with pytest.raises(e.NotHomedError, match=r"home\(\) first"):
                w.robot.unfold()
            w.robot.home()
            w.robot.unfold()

    return follow


def move(w: World) -> None:
    w.move()


def acknowledged(w: World) -> None:
    w.fail("overheat", "j2")
    w.bench.apply("clear")
    w.robot.acknowledge()
    w.move()


def recovered_at_once(w: World) -> None:
    if not w.robot.faults:
        w.fail("overheat", "j2")
        w.bench.apply("clear")
    w.robot.recover()


def recovered_without_supply(w: World) -> None:
    if not w.robot.faults:
        w.fail("supply", "", 0.0)
        w.robot.acknowledge()
    w.robot.recover()


def blocked(w: World) -> None:
    w.bench.apply("obstacle", "j1", HALF[0] + 0.1)
    w.robot.move_joints((HALF[0] + 0.5, *HALF[1:]))


def unwritable(w: World) -> None:
    if not w.robot.faults:
        w.evidence.write_text("")
        w.fail("overheat", "j2")
    w.robot.acknowledge()


def home_wrist(w: World) -> None:
    w.robot.home(["j4"])


def home_with_a_load(w: World) -> None:
    w.robot.attach(PLATE)
    w.robot.home()


def close_on_a_load(w: World) -> None:
    w.robot.gripper.enable()
    w.robot.attach(PLATE)
    w.robot.gripper.close()


def attach_twice(w: World) -> None:
    w.robot.attach(PLATE)
    w.robot.attach(PLATE)


def all_at_once(w: World) -> None:
    goal = Joints(-3.04568, 0.33792, 2.13498786, -1.29199182)
    w.robot.follow(point_to_point(NAMES, w.robot.state.positions, goal, ARM.joints))


def behind_the_wall(w: World) -> None:
    w.robot.move_joints(GOAL)


def with_a_wall(w: World) -> None:
    x, y, z, _ = w.robot.kinematics.forward(GOAL)
    size = 0.03
    wall = Box("wall", (x - size, y - size, z - size), (x + size, y + size, z + size))
    w.robot.scene = Scene((wall,))
    behind_the_wall(w)


def while_moving(w: World) -> None:
    w.robot.move_joints((0.8, *HALF[1:]), velocity_scaling=0.1, wait=False)
    w.move()


def paused_homing(w: World) -> None:
    w.robot.home(wait=False).pause()


def stop(w: World) -> None:
    for operation in w.robot.runner.arm.operations:
        operation.cancel()
        operation.wait()


def elsewhere(*, approach: bool = False) -> Callable[[World], object]:
    begin = (HALF[0] + 0.3, *HALF[1:])
    way = point_to_point(NAMES, begin, HALF, ARM.joints)
    return lambda w: w.robot.follow(way, approach=approach)


def misspelt(w: World) -> None:
    w.robot.speed_overide = 0.5


def scene_with(key: str) -> Callable[[World], object]:
    def read(w: World) -> None:
        path = w.evidence.with_name("scene.yaml")
        path.write_text(f"version: 1\n{key}: 0.0\nmargin: 0.005\nzones: []\n")
        read_scene(path)

    return read


REMEDIES = (
    Remedy("a call before `open()`", e.NotInitializedError, "open() it",
           lambda w: own_robot(w.evidence).state,
           then=lambda w: own_robot(w.evidence).open().close()),
    Remedy("`open()` of an open robot", e.LifecycleError, "use the one there is",
           lambda w: w.robot.open(), then=move),
    Remedy("a motion of an arm that is not homed", e.NotHomedError, "home() first",
           lambda w: w.robot.unfold(), lambda w: w.robot.home(), at=None),
    Remedy("a joint that restarted", e.FaultedError,
           "check the joint's supply and its reset button; then acknowledge() and recover()",
           failed("reset", "j4"), repaired(home=True), move),
    Remedy("a joint without supply", e.FaultedError, "then acknowledge() and recover()",
           failed("power", "j3", 0.0), repaired(home=True), move),
    Remedy("a joint that hangs", e.FaultedError, "then acknowledge() and recover()",
           failed("hang", "j3"), repaired(home=True), move),
    Remedy("a joint whose encoder stands still", e.FaultedError, "then acknowledge() and recover()",
           failed("freeze_encoder", "j2"), repaired(home=True), move),
    Remedy("a motor driver that is too hot", e.FaultedError,
           "let the joint's motor driver cool down; then acknowledge() and recover()",
           failed("overheat", "j2"), repaired(), move),
    Remedy("a bus whose data line is held low", e.FaultedError, "then acknowledge() and recover()",
           failed("bus_stuck"), repaired(), move),
    Remedy("a bus that loses everything", e.FaultedError, "then acknowledge() and recover()",
           failed("bus_loss"), repaired(), move),
    Remedy("an emergency stop", e.FaultedError,
           "release the emergency stop or restore the supply; then acknowledge() and recover()",
           failed("supply", "", 0.0), repaired(home=True), move),
    Remedy("no supply of the motors alone, which needs controllers that are fed from elsewhere",
           e.FaultedError,
           "release the emergency stop or restore the supply; then acknowledge() and recover()",
           failed("supply", "", 0.0), repaired(), move, fed=True),
    Remedy("a motion after an acknowledged fault", e.FaultedError, "; then recover()",
           acknowledged, lambda w: w.robot.recover(), move),
    Remedy("`recover()` before `acknowledge()`", e.FaultedError, "then acknowledge()",
           recovered_at_once, lambda w: w.robot.acknowledge()),
    Remedy("`recover()` while the supply is off", e.NoAcknowledgeError,
           "restore the supply, then recover() again",
           recovered_without_supply, lambda w: w.bench.apply("supply", "", 1.0)),
    Remedy("`recover()` while the supply of the motors alone is off", e.JointFaultError,
           "restore the supply, then recover() again",
           recovered_without_supply, lambda w: w.bench.apply("supply", "", 1.0), fed=True),
    Remedy("`acknowledge()` where the evidence cannot be written", e.RecordingError,
           "make the folder writable, and acknowledge() again",
           unwritable, lambda w: w.evidence.unlink()),
    Remedy("an obstacle", e.StalledError, "remove the obstacle", blocked, repaired(), move),
    Remedy("`home([\"j4\"])` of a homed arm", e.HomingError, "home j2 first",
           home_wrist, lambda w: w.robot.home(["j2"])),
    Remedy("`home([\"j4\"])` of a homed arm that is folded", e.HomingError,
           "unfold() first, and home it then",
           home_wrist, lambda w: w.robot.unfold(), at=tuple(FOLDED)),
    Remedy("homing with a load", e.LifecycleError, "take it off and detach() it",
           home_with_a_load, lambda w: w.robot.detach(), lambda w: w.robot.home(), at=None),
    Remedy("a gripper motion with a load", e.LifecycleError, "gripper.release() opens them",
           close_on_a_load, lambda w: w.robot.gripper.release(), lambda w: w.robot.gripper.close()),
    Remedy("a second load", e.LifecycleError, "detach() it first",
           attach_twice, lambda w: w.robot.detach(), lambda w: w.robot.attach(PLATE)),
    Remedy("`detach()` without a load", e.LifecycleError, "attach(load) declares one",
           lambda w: w.robot.detach(), lambda w: w.robot.attach(PLATE)),
    Remedy("a motion of all joints out of the folded position", e.ZoneError,
           "open the elbow first, by unfold()",
           all_at_once, lambda w: w.robot.unfold(),
           lambda w: w.robot.move_joints((-3.0, 0.3, 1.0, -1.0)), at=tuple(FOLDED)),
    Remedy("a goal in a zone", e.ZoneError, "choose another goal or correct the scene",
           with_a_wall, lambda w: setattr(w.robot, "scene", Scene()), behind_the_wall),
    Remedy("a joint position outside its limits", e.TrajectoryError,
           "is outside -0.0016 .. 0.338 m",
           lambda w: w.robot.move_joints((0.3, 0.9, 0.8, -0.5)), then=move),
    Remedy("a pose in millimetres", e.InvalidArgumentError, "are these millimetres?",
           lambda w: w.robot.move_to(Pose(350.0, 50.0, 250.0, 0.0)),
           then=lambda w: w.robot.move_to(Pose(0.35, 0.05, 0.25, 0.0))),
    Remedy("a pose out of reach", e.UnreachableError, "beyond",
           lambda w: w.robot.move_to(Pose(0.9, 0.0, 0.25, 0.0)),
           then=lambda w: w.robot.move_to(Pose(0.35, 0.05, 0.25, 0.0))),
    Remedy("a motion while another one runs", e.BusyError, "end it with stop()",
           while_moving, lambda w: (w.robot.stop(), stop(w)), move),
    Remedy("`pause()` of a homing", e.NotSupportedError, "cancel() ends it",
           paused_homing, stop, lambda w: w.robot.home(), at=None),
    Remedy("a trajectory that begins elsewhere", e.TrajectoryError, "approach",
           elsewhere(), then=elsewhere(approach=True)),
    Remedy("an unknown pose", e.InvalidArgumentError, "did you mean center?",
           lambda w: w.robot.move_named("centre"), then=lambda w: w.robot.move_named("center")),
    Remedy("a gripper width in millimetres", e.LimitError,
           "give a width between these, in metres",
           lambda w: w.robot.gripper.move(60.0), then=lambda w: w.robot.gripper.move(0.06)),
    Remedy("a misspelt attribute", AttributeError, "did you mean speed_override?",
           misspelt, then=lambda w: setattr(w.robot, "speed_override", 0.5)),
    Remedy("a scene file with a misspelt key", e.ConfigurationError, "did you mean table_height?",
           scene_with("table_hight"), then=scene_with("table_height")),
    Remedy("a bus on which no arm answers", e.BusUnavailableError, "bioscara simulate --socket",
           lambda w: Robot.connect(f"sim:{w.evidence}.sock").open(), then=move),
    Remedy("a bus that does not exist", e.InvalidArgumentError, "sim:/path.sock",
           lambda _: Robot.connect("can:0"), then=lambda _: Robot.connect("sim")),
    Remedy("an owner that does not run", e.OwnerLostError, "bioscara serve starts one",
           lambda _: Robot.connect("arm:nowhere").open(), then=move),
)  # fmt: skip


def commanded_elsewhere(w: World) -> None:
    if not w.others:
        w.others.append(RawClient("other"))
        w.others[0].acquire()
    w.robot.acquire_lease()


def stopped_elsewhere(w: World) -> None:
    w.robot.acquire_lease()
    with RawClient("other") as other:
        other.request(m.StopAll())
    eventually(lambda: w.robot._lease.held is None)
    w.move()


def release(w: World) -> None:
    (other,) = w.others
    other.request(m.ReleaseLease(), 1)
    other.socket.close()


def set_scene(revision: int | None) -> Callable[[World], object]:
    task = m.SetScene(scene=m.SceneValue(), revision=revision)
    return lambda w: w.robot.do(task)


SERVED = (
    Remedy("a command while another program commands the arm", e.LeaseError,
           "wait until it has released it, or take it over", commanded_elsewhere, release),
    Remedy("a command after another program stopped the arm", e.LeaseError,
           "acquire_lease() once the arm is safe to move again",
           stopped_elsewhere, lambda w: w.robot.acquire_lease(), move),
    Remedy("a change of a workspace that another program has changed", e.ConflictError,
           "read it again and repeat the change",
           set_scene(99), then=lambda w: set_scene(revision_of(w))(w)),
    Remedy("a second owner of a name", e.BusyOwnerError, "give another --name",
           lambda _: OwnerClaim(NAME, "sim"), then=lambda _: OwnerClaim("right", "sim").close()),
    Remedy("a call of a robot that was closed", e.NotInitializedError,
           "make another one to connect again",
           lambda w: (w.robot.close(), w.robot.state),
           then=lambda _: Robot.connect(f"arm:{NAME}").open().close()),
)  # fmt: skip
"""Those of an arm that an owner serves."""


def revision_of(w: World) -> int:
    state = w.robot._ask(m.GetWorkspace(), m.WorkspaceState)
    return int(state.revision)


@pytest.mark.parametrize("remedy", SERVED, ids=lambda row: row.when)
def test_a_remedy_of_a_served_arm_gets_further(remedy: Remedy, tmp_path: Path) -> None:
    with arm_served(), Robot.connect(f"arm:{NAME}") as robot:
        check(remedy, World(robot, tmp_path))


@pytest.mark.parametrize("remedy", REMEDIES, ids=lambda row: row.when)
def test_a_remedy_that_is_followed_gets_further(remedy: Remedy, tmp_path: Path) -> None:
    at, homed = remedy.at or HALF, remedy.at is not None
    with world(tmp_path, homed=homed, at=at, fed=remedy.fed) as w:
        check(remedy, w)


def test_the_table_of_the_documentation_has_each_row() -> None:
    document = DOCUMENT.read_text()
    rows = [
        f"| {row.when} | `{row.error.__name__}` | {row.says.lstrip('; ').replace('|', '')} |"
        for row in (*REMEDIES, *SERVED)
    ]
    assert [row for row in rows if row not in document] == []
    assert document.count("| `") >= len(rows)
