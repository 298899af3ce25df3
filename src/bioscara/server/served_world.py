"""The world around an arm that the owner itself simulates: its samples, and its disturbances."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from typing import Any, TypeVar

from bioscara.api import messages as m
from bioscara.errors import InvalidArgumentError
from bioscara.physics.camera import camera_of, checked_size
from bioscara.physics.stills import still_of
from bioscara.physics.world import PhysicsWorld
from bioscara.printing import printable
from bioscara.robot.runner import Runner
from bioscara.robot.simulation import world_of
from bioscara.server.channel.channel_messages import WorldStill
from bioscara.server.clients.client import Client, Later
from bioscara.server.controllers.requests import Handler
from bioscara.server.state.world_sampling import WorldSampler

T = TypeVar("T")

_NAME_MAX = 64
"""Longest name of an obstacle [characters]."""


class ServedWorld:
    """The world around an arm, if there is one.

    Args:
        runner: Runs the operations of the arm.
        announce: Called with kind, text and client's name of an event, in the thread of requests.

    Attributes:
        sample: The newest sample, once one was wanted.
        wanted: Whether a client has subscribed to samples.
        handlers: How its commands are carried out.
    """

    def __init__(self, runner: Runner, announce: Callable[[m.EventKind, str, str], object]) -> None:
        self._runner, self._announce = runner, announce
        world = getattr(runner.arm.session.bus, "world", None)
        self._sampler = WorldSampler(world) if isinstance(world, PhysicsWorld) else None
        self._last = (0, 0.0)
        self.sample: m.WorldSample | None = None
        self.wanted = False
        self.handlers: dict[type[m.Command], Handler] = {
            m.GetBodies: lambda *_: self._ask(lambda sampler: sampler.bodies),
            m.GetWorld: lambda *_: self._ask(lambda sampler: sampler.sample(*self._last)),
            m.GetImage: self._image,
            **dict.fromkeys(_DISTURBANCES, self._disturb),
        }

    def observe(self, cycle: int, time: float) -> None:
        """Take a sample if it is due, in the control loop.

        Args:
            cycle: Number of the cycle.
            time: Its begin, on the arm's clock [s].
        """
        self._last = cycle, time
        if self.wanted and self._sampler is not None and self._sampler.due(time):
            self.sample = self._sampler.sample(cycle, time)

    def _ask(self, work: Callable[[WorldSampler], T]) -> Later:
        """Return an answer that is made between two cycles.

        Raises:
            NotSupportedError: There is no world.
        """
        sampler = self._sampler
        if sampler is None:
            world_of(self._runner.arm)
        return self._aside(lambda: work(sampler))  # type: ignore[arg-type]  # refused else

    def _image(self, _: Client, command: m.GetImage, __: int) -> Later:
        """Return a copy to draw in another process: here it would delay the loop."""
        world = world_of(self._runner.arm)
        camera_of(command.camera)
        checked_size((command.width, command.height))

        def work() -> WorldStill:
            still, time = self._runner.aside("an image", lambda: (still_of(world), self._last[1]))
            state = pickle.dumps((still.positions, still.rotations))
            return WorldStill(time, pickle.dumps(still.model), state)

        return Later(work)

    def _disturb(self, client: Client, command: m.Disturbance, _: int) -> Later:
        world = world_of(self._runner.arm)
        if isinstance(command, m.AddObstacle):
            _require_short(command.name)
        change, words = _DISTURBANCES[type(command)]

        def finish(_: object) -> None:
            self._announce("simulation", f"{client.name} {words(command)}", client.name)

        return self._aside(lambda: change(world, command))._replace(finish=finish)

    def _aside(self, work: Callable[[], Any]) -> Later:
        return Later(lambda: self._runner.aside("the simulated world", work))


def _require_short(name: str) -> None:
    if printable(name) != name or not 0 < len(name) <= _NAME_MAX:
        raise InvalidArgumentError(
            f"an obstacle has a name of 1 to {_NAME_MAX} printable characters, not "
            f"{printable(name)!r}"
        )


def _force(command: m.PushBody) -> str:
    force = ", ".join(f"{part:g}" for part in command.force)
    return f"pushes {command.name} by {force} N for {command.duration:g} s"


_DISTURBANCES: dict[
    type[m.Command], tuple[Callable[[PhysicsWorld, Any], object], Callable[[Any], str]]
] = {
    m.PushBody: (lambda world, it: world.push(it.name, it.force, it.duration), _force),
    m.TiltBody: (
        lambda world, it: world.tilt(it.name, it.height, it.direction),
        lambda it: f"tilts {it.name} by {1e3 * it.height:g} mm",
    ),
    m.AddObstacle: (
        lambda world, it: world.add_obstacle(it.name, it.lower, it.upper),
        lambda it: f"puts the obstacle {it.name} into the world",
    ),
    m.TakeAway: (
        lambda world, it: world.take_away(it.name),
        lambda it: f"takes {it.name} away",
    ),
}
"""The change that each disturbance is, and the words for it."""
