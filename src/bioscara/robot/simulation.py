"""The world of an arm that is simulated in this process; nothing here is a command of the arm."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple, TypeVar

from bioscara.errors import InvalidArgumentError, LifecycleError, NotSupportedError
from bioscara.physics.bodies import BodyPose, BodyShape
from bioscara.physics.camera import Camera, Image
from bioscara.physics.stills import SIZE, image_of, still_of
from bioscara.physics.world import PhysicsWorld, WorldSnapshot
from bioscara.robot.arm import Arm

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


class Simulation:
    """The world around a simulated arm: its bodies, and disturbances of them.

    Disturbances need no lease and do not wait for the arm: they are the world, not commands.

    Args:
        robot: The robot.
    """

    def __init__(self, robot: Robot) -> None:
        self._robot, self._runner = robot, robot.runner
        self._world = world_of(self._runner.arm)

    @property
    def held(self) -> str | None:
        """Name of the body that both jaws press on; None if there is none. No real arm knows it."""
        return self._aside("simulation.held", lambda: self._world.held)

    @property
    def width(self) -> float:
        """True width between the jaws [m]."""
        return self._aside("simulation.width", lambda: self._world.width)

    @property
    def bodies(self) -> tuple[BodyShape, ...]:
        """The bodies of the world."""
        return self._world.shapes

    @property
    def poses(self) -> tuple[BodyPose, ...]:
        """Where they are, in the base frame, in the same order."""
        return self._aside("simulation.poses", self._world.poses)

    def pose(self, name: str) -> BodyPose:
        """Return where a body is, in the base frame.

        Raises:
            InvalidArgumentError: There is no body of that name.
        """
        for pose in self.poses:
            if pose.name == name:
                return pose
        names = ", ".join(shape.name for shape in self.bodies)
        raise InvalidArgumentError(f"there is no body {name!r} in the world; there are {names}")

    def image(self, camera: str | Camera = "front", size: tuple[int, int] = SIZE) -> Image:
        """Return an image of arm and bodies as they are now; the arm does not wait for it.

        It is drawn in the thread of the caller, from a copy of their positions. The first one of a
        thread takes about 0.2 s longer.

        Args:
            camera: Name of a camera, ``"front"``, ``"side"``, ``"top"`` or ``"wrist"``, or a
                :class:`bioscara.physics.camera.Camera`.
            size: Width and height, 16 to 2048 pixels each.

        Returns:
            Red, green and blue of each pixel, rows from the top, shape (height, width, 3), uint8.

        Raises:
            InvalidArgumentError: The size is outside its range, or the camera is unknown.
            NotSupportedError: The extra ``physics-view`` is missing, or a library of the system
                that draws without a screen.
        """
        still = self._aside("simulation.image()", lambda: still_of(self._world))
        return image_of(still, camera, size)

    def push(self, name: str, force: Sequence[float], duration: float = 0.1) -> None:
        """Push a body, or a link of the arm; arguments and errors as :meth:`PhysicsWorld.push`."""
        self._aside("simulation.push()", lambda: self._world.push(name, force, duration))

    def tilt(self, name: str, height: float, direction: float = 0.0) -> None:
        """Tilt a nest; arguments and errors as :meth:`PhysicsWorld.tilt`."""
        self._aside("simulation.tilt()", lambda: self._world.tilt(name, height, direction))

    def add_obstacle(self, name: str, lower: Sequence[float], upper: Sequence[float]) -> None:
        """Put a box into the world; arguments, errors as :meth:`PhysicsWorld.add_obstacle`."""
        self._aside(
            "simulation.add_obstacle()", lambda: self._world.add_obstacle(name, lower, upper)
        )

    def take_away(self, name: str) -> None:
        """Take a body out of the world; arguments, errors as :meth:`PhysicsWorld.take_away`."""
        self._aside("simulation.take_away()", lambda: self._world.take_away(name))

    def save(self) -> SimulationSnapshot:
        """Return the state of the joints, their firmware, the servo and the bodies.

        Raises:
            BusyError: The arm moves.
            LifecycleError: A simulated fault lasts.
        """
        self._require_rest("save()")
        enabled = self._disabled()
        world = self._aside("simulation.save()", self._world.save)
        if enabled:
            self._robot.enable()
        return SimulationSnapshot(world, enabled)

    def restore(self, snapshot: SimulationSnapshot) -> None:
        """Return to a state of this robot; simulated time goes on.

        The joints are enabled if they were then. The workspace stays as it is: declare the
        load that the tool carries then.

        Args:
            snapshot: Of :meth:`save`.

        Raises:
            InvalidArgumentError: It is of another world, or bodies came or went since.
            BusyError: The arm moves.
            LifecycleError: A simulated fault lasts.
        """
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
