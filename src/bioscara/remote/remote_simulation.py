"""The world around an arm that its owner simulates."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from bioscara.api import messages as m
from bioscara.api.values import placed
from bioscara.arguments import number, numbers, text
from bioscara.errors import InvalidArgumentError
from bioscara.physics.bodies import BodyPose, BodyShape
from bioscara.physics.camera import (
    CAMERAS,
    SIZE,
    Camera,
    Image,
    camera_of,
    checked_size,
    pixels,
)  # fmt: skip
from bioscara.robot.simulated_world import SimulatedWorld


class RemoteSimulation(SimulatedWorld):
    """The simulation of an owner: world, faults and time.

    Args:
        ask: Sends a command to the owner, and returns its result, which is of the given type.
        subscribe: Lets the owner send samples of the world.

    Attributes:
        newest: The newest sample since :meth:`subscribe`; None before the first.
    """

    def __init__(
        self, ask: Callable[[Any, type[Any]], Any], subscribe: Callable[[], object]
    ) -> None:
        self._ask, self._subscribe = ask, subscribe
        self.newest: m.WorldSample | None = None
        self._list: m.BodyList | None = None

    @property
    def held(self) -> str | None:
        return self.sample().held

    @property
    def width(self) -> float:
        return self.sample().width

    @property
    def bodies(self) -> tuple[BodyShape, ...]:
        return self.body_list(self.sample()).bodies

    @property
    def poses(self) -> tuple[BodyPose, ...]:
        sample = self.sample()
        return placed(self.body_list(sample), sample)

    def image(self, camera: str | Camera = "front", size: tuple[int, int] = SIZE) -> Image:
        return pixels(self.image_file(camera, size).data)

    def image_file(self, camera: str | Camera, size: tuple[int, int]) -> m.ImageFile:
        """Return an image as a PNG file, with its time; arguments and errors as :meth:`image`."""
        if isinstance(camera, Camera):
            raise InvalidArgumentError(
                f"an owner has the cameras {', '.join(CAMERAS)}; give the name of one of them"
            )
        camera_of(camera)
        width, height = checked_size(size)
        asked = m.GetImage(camera=camera, width=width, height=height)
        file: m.ImageFile = self._ask(asked, m.ImageFile)
        return file

    def push(self, name: str, force: Sequence[float], duration: float = 0.1) -> None:
        self._disturb(
            m.PushBody(
                name=text("name of the body", name),
                force=_vector("force", force),
                duration=number("duration", duration),
            )
        )

    def tilt(self, name: str, height: float, direction: float = 0.0) -> None:
        self._disturb(
            m.TiltBody(
                name=text("name of the body", name),
                height=number("height", height),
                direction=number("direction", direction),
            )
        )

    def add_obstacle(self, name: str, lower: Sequence[float], upper: Sequence[float]) -> None:
        self._disturb(
            m.AddObstacle(
                name=text("name of the obstacle", name),
                lower=_vector("lower", lower),
                upper=_vector("upper", upper),
            )
        )

    def take_away(self, name: str) -> None:
        self._disturb(m.TakeAway(text("name of the body", name)))

    @property
    def available(self) -> bool:
        """Whether the owner simulates the arm itself."""
        return self._state().available

    @property
    def real_time_factor(self) -> float:
        """Simulated time in a second of real time; NaN if the owner does not simulate."""
        return self._state().real_time_factor

    @property
    def faults(self) -> tuple[m.SimulatedFaultValue, ...]:
        """The simulated faults that last."""
        return self._state().faults

    def subscribe(self) -> None:
        """Let the owner send samples; an arm without a world sends none."""
        self._subscribe()

    def receive(self, sample: m.WorldSample) -> None:
        """Take a sample; called in the thread of the connection."""
        self.newest = sample

    def sample(self) -> m.WorldSample:
        """Return the held body, the width between the jaws, and the bodies that have moved."""
        sample: m.WorldSample = self._ask(m.GetWorld(), m.WorldSample)
        return sample

    def body_list(self, sample: m.WorldSample) -> m.BodyList:
        """Return the bodies that a sample belongs to, or newer ones."""
        known = self._list
        if known is None or known.version != sample.version:
            known = self._list = self._ask(m.GetBodies(), m.BodyList)
        return known

    def _disturb(self, command: m.Disturbance) -> None:
        self._ask(command, m.Done)

    def _state(self) -> m.SimulationState:
        state: m.SimulationState = self._ask(m.GetSimulation(), m.SimulationState)
        return state


def _vector(what: str, values: Sequence[float]) -> tuple[float, float, float]:
    found = numbers(what, values, "give x, y, z")
    if len(found) != 3:
        raise InvalidArgumentError(f"{what} has {len(found)} values; give x, y, z")
    return (found[0], found[1], found[2])
