"""The world around a simulated arm, as programs see it: of this process, or of an owner."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

from bioscara.arguments import text
from bioscara.errors import InvalidArgumentError, NotSupportedError
from bioscara.physics.bodies import BodyPose, BodyShape
from bioscara.physics.camera import SIZE, Camera, Image
from bioscara.spelling import did_you_mean


class SimulatedWorld(ABC):
    """The world around a simulated arm: its bodies, and disturbances of them.

    Disturbances need no lease and do not wait for the arm: they are the world, not commands. For an
    arm without a world, which a real one is too, all of this raises a NotSupportedError.
    """

    @property
    @abstractmethod
    def held(self) -> str | None:
        """Name of the body that both jaws press on; None if there is none. No real arm knows it."""

    @property
    @abstractmethod
    def width(self) -> float:
        """True width between the jaws [m]."""

    @property
    @abstractmethod
    def bodies(self) -> tuple[BodyShape, ...]:
        """The bodies around the arm."""

    @property
    @abstractmethod
    def poses(self) -> tuple[BodyPose, ...]:
        """Where they are, in the base frame, in the same order."""

    def pose(self, name: str) -> BodyPose:
        """Return where a body is, in the base frame.

        Raises:
            InvalidArgumentError: There is no body of that name.
        """
        name, poses = text("name of the body", name), self.poses
        for pose in poses:
            if pose.name == name:
                return pose
        names = [pose.name for pose in poses]
        hint = did_you_mean(name, names, f"there are {', '.join(names)}")
        raise InvalidArgumentError(f"there is no body {name!r} in the world; {hint}")

    @abstractmethod
    def image(self, camera: str | Camera = "front", size: tuple[int, int] = SIZE) -> Image:
        """Return an image of arm and bodies as they are now; the arm does not wait for it.

        It is drawn in the thread of the caller, or in a process of the owner, from a copy of the
        positions. The first one takes about 0.2 s longer, of an owner 1 s.

        Args:
            camera: Name of a camera, ``"front"``, ``"side"``, ``"top"`` or ``"wrist"``; of an arm
                of this process also a :class:`bioscara.physics.camera.Camera`.
            size: Width and height, 16 to 2048 pixels each.

        Returns:
            Red, green and blue of each pixel, rows from the top, shape (height, width, 3), uint8.

        Raises:
            InvalidArgumentError: The size is outside its range, or the camera is unknown.
            NotSupportedError: The extra ``physics-view`` is missing where the arm is simulated, or
                a library of the system that draws without a screen.
        """

    @abstractmethod
    def push(self, name: str, force: Sequence[float], duration: float = 0.1) -> None:
        """Push a piece of labware, or a link of the arm.

        Args:
            name: Its name; ``link_1`` to ``link_4`` are the arm's.
            force: x, y, z in the base frame [N], each at most 50.
            duration: At most 10 s of the arm's time.

        Raises:
            InvalidArgumentError: There is no such body, it is fixed, or a value is not finite.
            LimitError: A value is outside its range.
        """

    @abstractmethod
    def tilt(self, name: str, height: float, direction: float = 0.0) -> None:
        """Tilt a nest, a wall or an obstacle about its origin.

        Args:
            name: Its name.
            height: By how much the end of a plate that lies on it is raised, 0 to 0.02 m; 0 ends
                it.
            direction: Direction of that end, from the body's x axis [rad].

        Raises:
            InvalidArgumentError: There is no such body, it moves freely, or a value is not finite.
            LimitError: The height is outside its range.
        """

    @abstractmethod
    def add_obstacle(self, name: str, lower: Sequence[float], upper: Sequence[float]) -> None:
        """Put a fixed box into the world.

        Args:
            name: A new name.
            lower: Smallest x, y, z in the base frame [m].
            upper: Largest x, y, z [m].

        Raises:
            InvalidArgumentError: The name is taken, a value is not finite, or the box is inside the
                arm or another body.
            LimitError: There are too many bodies.
        """

    @abstractmethod
    def take_away(self, name: str) -> None:
        """Take labware, a nest, a wall or an obstacle out of the world.

        Args:
            name: Its name.

        Raises:
            InvalidArgumentError: There is no such body.
            LifecycleError: The jaws hold it.
        """

    def save(self) -> Any:
        """Return the state of the joints, their firmware, the servo and the bodies.

        Raises:
            NotSupportedError: The arm is simulated in another process.
            BusyError: The arm moves.
            LifecycleError: A simulated fault lasts.
        """
        raise _elsewhere("save()")

    def restore(self, snapshot: Any) -> None:  # noqa: ARG002  of the subclass
        """Return to a state of this robot; simulated time goes on.

        The joints are enabled if they were then. The workspace stays as it is: declare
        the load that the tool carries then.

        Args:
            snapshot: Of :meth:`save`.

        Raises:
            NotSupportedError: The arm is simulated in another process.
            InvalidArgumentError: It is of another world, or bodies came or went since.
            BusyError: The arm moves.
            LifecycleError: A simulated fault lasts.
        """
        raise _elsewhere("restore()")


def _elsewhere(what: str) -> NotSupportedError:
    return NotSupportedError(
        f"simulation.{what} is for an arm that is simulated in this process, of "
        "Robot.simulated(world=FILE); this one belongs to another process"
    )
