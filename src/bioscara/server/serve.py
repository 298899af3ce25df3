"""Serving an arm: the owner's loop, its socket and its gateways, until a request to end."""

from __future__ import annotations

import asyncio
import grp
import logging
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from bioscara.api.runtime import OwnerClaim
from bioscara.errors import ConfigurationError, HardwareError
from bioscara.planning.collision.scene import Scene
from bioscara.processes.nursery import start_early
from bioscara.robot import FAULTS, Robot
from bioscara.server.channel.api_process import MODULES
from bioscara.server.channel.motion_planning import MotionPlanning
from bioscara.server.channel.owner_end import ApiProcess
from bioscara.server.gateways import Gateways
from bioscara.server.owner import Owner

_LOOP_CHECK = 0.2
"""Period of the check that the control loop runs [s]."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class ServeSettings:
    """How an arm is served.

    Attributes:
        name: Name of the owner.
        bus: Name of the bus.
        overlay: File with the values in which this arm differs; None if there is none.
        evidence: Folder of the flight records.
        table: File with the poses, tools and frames; None if those of clients are not kept.
        scene: File with the zones and the table; None if there is none.
        declared: Scene at the start where there is no such file, as that of a world; it needs no
            confirmation, and is not saved.
        bench: File in which the next owner finds the scene, the tool and the load; None if they are
            not kept.
        group: Group whose members may be clients; empty for this user alone.
        gateways: Words of ``bioscara`` that run each of its gateways.
        priority: Real-time priority of the control loop; None for none.
        real_time_factor: Factor by which simulated time is faster than real time.
    """

    name: str
    bus: str
    overlay: Path | None = None
    evidence: Path = FAULTS
    table: Path | None = None
    scene: Path | None = None
    declared: Scene | None = None
    bench: Path | None = None
    group: str = ""
    gateways: Sequence[tuple[str, ...]] = ()
    priority: int | None = None
    real_time_factor: float = 1.0

    @property
    def simulated(self) -> bool:
        """Whether the arm is simulated."""
        return self.bus.partition(":")[0] == "sim"


async def serve(
    robot: Robot,
    settings: ServeSettings,
    claim: OwnerClaim,
    ended: asyncio.Event,
    ready: Callable[[Owner], object],
) -> None:
    """Serve an arm until ``ended``, then bring it to rest and release it.

    Args:
        robot: The arm, connected.
        settings: How it is served.
        claim: The claim to its name.
        ended: Set to end.
        ready: Called when clients can connect.

    Raises:
        ConfigurationError: There is no such group, or clients cannot be answered.
        BioscaraError: The arm cannot be watched, or a joint could not be released.
        OSError: The socket cannot be made.
    """
    loop, group = asyncio.get_running_loop(), _group_number(settings.group)

    def post(function: Callable[[], object]) -> None:
        # The loop may have ended since: then there is no receiver.
        with suppress(RuntimeError):
            loop.call_soon_threadsafe(function)

    owner = Owner(
        robot,
        settings.name,
        post,
        simulated=settings.simulated,
        overlay=settings.overlay,
        table=settings.table,
        scene=settings.scene,
        declared=settings.declared,
        bench=settings.bench,
    )
    # Before the loop: its priority and its locked memory are not theirs.
    start_early(MODULES)
    planning = MotionPlanning()
    planning.start(robot.runner.arm.workspace)
    robot.runner.arm.planning = planning
    robot.watch(priority=settings.priority, real_time_factor=settings.real_time_factor)
    server = ApiProcess(owner, claim, settings.evidence, group)
    gateways = Gateways(settings.gateways, settings.name, owner.announce)
    try:
        await server.start()
        gateways.start()
        ready(owner)
        crashed = await _ended(robot, ended)
        owner.announce("owner", f"{settings.name} ends: the arm comes to rest and is released")
        robot.stop()
    finally:
        try:
            await asyncio.to_thread(robot.close)
        finally:
            # Posts of the last cycles come first.
            await asyncio.sleep(0.0)
            owner.report_ended()
            # Last, so that a recorder gets the end of the last goal.
            await gateways.close()
            await server.close()
            planning.close()
    if crashed:
        raise HardwareError(
            f"the control loop of {settings.name} has ended, which is a defect of this software; "
            "the joints are released, and the log has the cause"
        )


def _group_number(name: str) -> int | None:
    if not name:
        return None
    try:
        return grp.getgrnam(name).gr_gid
    except KeyError:
        raise ConfigurationError(f"there is no group {name!r}; groupadd makes one") from None


async def _ended(robot: Robot, ended: asyncio.Event) -> bool:
    """Return when the service has to end, and whether that is because the loop has ended."""
    while not ended.is_set():
        if not robot.runner.watched:
            return True
        with suppress(TimeoutError):
            await asyncio.wait_for(ended.wait(), _LOOP_CHECK)
    return False


class Served:
    """An arm that is served by a thread of this process.

    Attributes:
        owner: The owner.
        robot: The arm.
    """

    def __init__(self, robot: Robot, settings: ServeSettings) -> None:
        self.robot, self._settings = robot, settings
        self._claim = OwnerClaim(settings.name, settings.bus, shared=bool(settings.group))
        self._ready = threading.Event()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._ended: asyncio.Event | None = None
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="bioscara-served")
        self.owner: Owner

    def start(self) -> None:
        """Return when clients can connect.

        Raises:
            BioscaraError, OSError: It cannot be served.
        """
        self._thread.start()
        self._ready.wait()
        if self._error is not None:
            self._thread.join()
            self._claim.close()
            raise self._error

    def close(self) -> None:
        """End the service and release the arm."""
        if self._loop is not None and self._ended is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._ended.set)
        self._thread.join()
        self._claim.close()
        if self._error is not None:
            raise self._error

    def _run(self) -> None:
        async def run() -> None:
            self._loop, self._ended = asyncio.get_running_loop(), asyncio.Event()
            await serve(self.robot, self._settings, self._claim, self._ended, self._begun)

        try:
            asyncio.run(run())
        except BaseException as error:  # noqa: BLE001  raised by start() or close()
            self._error = error
        finally:
            self._ready.set()

    def _begun(self, owner: Owner) -> None:
        self.owner = owner
        self._ready.set()


@contextmanager
def serving(robot: Robot, settings: ServeSettings) -> Iterator[Served]:
    """Serve an arm for a block of code, in a thread of this process.

    Args:
        robot: The arm; opened unless it is, and closed at the end.
        settings: How it is served.

    Raises:
        BioscaraError, OSError: It cannot be opened or served.
    """
    with robot:
        served = Served(robot, settings)
        served.start()
        try:
            yield served
        finally:
            served.close()
