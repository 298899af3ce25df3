"""The world of an arm that is simulated in this process; nothing here is a command of the arm."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple, TypeVar

from bioscara.errors import InvalidArgumentError, LifecycleError, NotSupportedError
from bioscara.physics.bodies import BodyPose, BodyShape
from bioscara.physics.camera import SIZE, Camera, Image
from bioscara.physics.stills import image_of, still_of
from bioscara.physics.world import PhysicsWorld, WorldSnapshot
from bioscara.robot.arm import Arm
from bioscara.robot.simulated_world import SimulatedWorld

if TYPE_CHECKING:
    from bioscara.robot.robot import Robot

T = TypeVar("T")


class SimulationSnapshot(NamedTuple):
    """The state of a simulated arm and of its world; for the robot that made it.

    Attributes:
        world: Of joints, servo and bodies.
        enabled: Whether the joints were enabled.
    """

    world: WorldSnapshot
    enabled: bool

    def __reduce__(self) -> str:
        raise LifecycleError(
            "a snapshot of a simulation cannot leave its process: it fits this arm alone, and no "
            "other version; record the motion, or repeat it with the same seed"
        )


class Simulation(SimulatedWorld):
    """The world around an arm that is simulated in this process.

    Args:
        robot: The robot.
    """

    def __init__(self, robot: Robot) -> None:
        self._robot, self._runner = robot, robot.runner
        self._world = world_of(self._runner.arm)

    @property
    def held(self) -> str | None:
        return self._aside("simulation.held", lambda: self._world.held)

    @property
    def width(self) -> float:
        return self._aside("simulation.width", lambda: self._world.width)

    @property
    def bodies(self) -> tuple[BodyShape, ...]:
        return self._world.shapes

    @property
    def poses(self) -> tuple[BodyPose, ...]:
        return self._aside("simulation.poses", self._world.poses)

    def image(self, camera: str | Camera = "front", size: tuple[int, int] = SIZE) -> Image:
        still = self._aside("simulation.image()", lambda: still_of(self._world))
        return image_of(still, camera, size)

    def push(self, name: str, force: Sequence[float], duration: float = 0.1) -> None:
        self._aside("simulation.push()", lambda: self._world.push(name, force, duration))

    def tilt(self, name: str, height: float, direction: float = 0.0) -> None:
        self._aside("simulation.tilt()", lambda: self._world.tilt(name, height, direction))

    def add_obstacle(self, name: str, lower: Sequence[float], upper: Sequence[float]) -> None:
        self._aside(
            "simulation.add_obstacle()", lambda: self._world.add_obstacle(name, lower, upper)
        )

    def take_away(self, name: str) -> None:
        self._aside("simulation.take_away()", lambda: self._world.take_away(name))

    def save(self) -> SimulationSnapshot:
        self._require_rest("save()")
        enabled = self._disabled()
        world = self._aside("simulation.save()", self._world.save)
        if enabled:
            self._robot.enable()
        return SimulationSnapshot(world, enabled)

    def restore(self, snapshot: SimulationSnapshot) -> None:
        if not isinstance(snapshot, SimulationSnapshot):
            raise InvalidArgumentError(f"{snapshot!r} is no snapshot; give one of save()")
        self._world.require_fits(snapshot.world)
        self._require_rest("restore()")
        self._disabled()
        self._aside("simulation.restore()", lambda: self._world.restore(snapshot.world))
        if snapshot.enabled:
            self._robot.enable()

    def _disabled(self) -> bool:
        """Disable joints that are enabled: what commands them then begins anew; return whether."""
        enabled = self._robot.is_enabled
        if enabled:
            self._robot.disable()
        return enabled

    def _require_rest(self, what: str) -> None:
        arm = self._runner.arm
        if arm.arbiter.running:
            raise arm.arbiter.running[0].refuse(f"simulation.{what}")
        if arm.session.bus.bench.faults:  # type: ignore[attr-defined]  # it is simulated
            raise LifecycleError(
                f"simulation.{what} is for an arm without simulated faults; "
                'simulate_fault("clear") ends them'
            )

    def _aside(self, name: str, work: Callable[[], T]) -> T:
        if not self._runner.arm.session.connected:
            return work()
        return self._runner.aside(name, work)


def world_of(arm: Arm) -> PhysicsWorld:
    """Return the world around an arm.

    Raises:
        NotSupportedError: It has none.
    """
    world = getattr(arm.session.bus, "world", None)
    if not isinstance(world, PhysicsWorld):
        raise NotSupportedError(
            "this arm has no simulated world: it is real, simulated by another process, or was "
            "made without one; give Robot.simulated(world=FILE)"
        )
    return world
