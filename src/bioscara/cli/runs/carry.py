"""``bioscara demo`` with a simulated world: a plate is carried from one nest to another."""

from __future__ import annotations

import math
from importlib.resources import as_file, files

from bioscara.cli.motion import Progress
from bioscara.cli.parser import Options
from bioscara.cli.runs.job import JobResult
from bioscara.planning.collision.scene import Scene
from bioscara.planning.world import Item, World, read_world
from bioscara.report import CycleRecord, RunFolder
from bioscara.robot.arm_methods import ArmMethods
from bioscara.robot.workspace.load import Load

_PLATE, _FROM, _TO = "plate", "a", "b"
_LIFT = 0.04
"""Height by which the plate is lifted out of its nest [m]."""
_ABOVE = 3e-4
"""Height above the floor of the nest at which the plate is released [m]."""
_DURATION = 25.0
"""Time that the motions take, about [s]."""


def demo_world() -> World:
    """Return the world of the demonstration."""
    with as_file(files("bioscara.cli.runs").joinpath("demo_world.yaml")) as path:
        return read_world(path)


class CarryJob:
    """Carries the plate of a world from its nest to another one, and measures the result.

    Args:
        world: The world.
    """

    title = "demo"
    source = f"demonstration: a plate from nest {_FROM} to nest {_TO}"
    notes: tuple[str, ...] = ()
    introduction = f"{source}, in a simulated world"

    def __init__(self, world: World) -> None:
        self._world = world

    @property
    def scene(self) -> Scene:
        """Surroundings to keep clear of at first."""
        return self._world.planned

    def cycles(self, period: float) -> int:
        """Return how many records its motion has, about."""
        return int(_DURATION / period)

    def keep(self, folder: RunFolder) -> None:
        """Write nothing: each motion is planned where the last one ended."""

    def perform(
        self,
        robot: ArmMethods,
        folder: RunFolder,  # noqa: ARG002
        progress: Progress,
        options: Options,  # noqa: ARG002
    ) -> JobResult:
        """Carry the plate, and measure where it is then."""
        world, cycle = self._world, OneMotion(progress)
        plate, goal = world.item(_PLATE), world.placed(_PLATE, _TO).item(_PLATE)
        start, end = plate.grip.pose, goal.grip.pose
        load = Load(_PLATE, plate.shape_in_tool, plate.mass, (_FROM, _TO))
        progress.phase(f"taking the plate out of nest {_FROM}")
        robot.gripper.open(on_cycle=cycle)
        robot.move_to(start.up(_LIFT), on_cycle=cycle)
        robot.move_linear(start, on_cycle=cycle)
        # The jaws are around it: from here on it is the arm's.
        robot.scene = world.without(_PLATE).planned
        robot.gripper.grasp(load, on_cycle=cycle)
        robot.move_linear(start.up(_LIFT), on_cycle=cycle)
        held = robot.simulation.held
        progress.phase(f"carrying it to nest {_TO}")
        robot.move_to(end.up(_LIFT), on_cycle=cycle)
        robot.move_linear(end.up(_ABOVE), on_cycle=cycle)
        robot.gripper.release(on_cycle=cycle)
        robot.scene = world.placed(_PLATE, _TO).planned
        progress.phase("leaving it there")
        robot.move_linear(end.up(_LIFT), on_cycle=cycle)
        return JobResult(cycle.time, measured=_measured(robot, held, goal))


def _measured(robot: ArmMethods, held: str | None, goal: Item) -> tuple[str, ...]:
    """Return as sentences whether the plate was held, and where it is now."""
    pose = robot.simulation.pose(_PLATE)
    off_place = math.dist((pose.x, pose.y, pose.z), (goal.x, goal.y, goal.z))
    turn = 2.0 * math.atan2(pose.qz, pose.qw) - goal.yaw
    off = abs(math.remainder(turn, 2.0 * math.pi))
    grip = "held in the air" if held == _PLATE else "NOT HELD in the air"
    placed = (
        f"placed {1e3 * off_place:.2f} mm from its place in nest {_TO}, turned by "
        f"{math.degrees(off):.2f} deg"
    )
    return f"the plate was {grip}", placed


class OneMotion:
    """Passes the cycles of several motions on as those of one.

    Args:
        progress: Gets them.

    Attributes:
        time: Time since the first motion began [s].
    """

    def __init__(self, progress: Progress) -> None:
        self._progress = progress
        self._start: float | None = None
        self.time = 0.0

    def __call__(self, record: CycleRecord) -> None:
        """Accept a cycle, as ``on_cycle`` of a motion."""
        if self._start is None:
            self._start = record.start
        self.time = record.start - self._start
        self._progress.cycle(record._replace(trajectory_time=self.time))
