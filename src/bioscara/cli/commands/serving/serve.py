"""``bioscara serve``."""

from __future__ import annotations

import asyncio
import os
import signal
from pathlib import Path

from bioscara.api.runtime import OwnerClaim
from bioscara.cli.arm_parameters import parameters_from
from bioscara.cli.options import Options
from bioscara.cli.output.console import ExitStatus, Output
from bioscara.cli.signals import StopRequest
from bioscara.cli.teach_table import table_file
from bioscara.connect import Robot
from bioscara.errors import ConfigurationError, InvalidArgumentError
from bioscara.server import log
from bioscara.server.owner import Owner
from bioscara.server.serve import ServeSettings, serve


def _with_one_address(words: tuple[str, ...]) -> tuple[str, ...]:
    """Return the words of a gateway; that for browsers prints one address, that of operators."""
    if words[0] != "web" or "--show" in words:
        return words
    return ("web", "--show", "operate", *words[1:])


def _existing(scene: Path | None) -> Path | None:
    """Return the file with the zones; a name that is misspelt would be an arm without zones.

    Raises:
        ConfigurationError: There is no such file.
    """
    if scene is not None and not scene.exists():
        raise ConfigurationError(
            f"--scene {scene} does not exist; correct its name, or write one: docs/motion.md has "
            "the format"
        )
    return scene


def _state_folder() -> Path:
    """Return the folder for what the next owner has to know: of the service, or of this user."""
    if service := os.environ.get("STATE_DIRECTORY"):
        return Path(service.split(":")[0])
    return Path(os.environ.get("XDG_STATE_HOME") or "~/.local/state").expanduser() / "bioscara"


def run(options: Options) -> int:
    """Own an arm until Ctrl-C or SIGTERM; it is at rest and released then.

    Raises:
        InvalidArgumentError: An option cannot be used.
        BusyOwnerError: An owner of that name runs.
        BioscaraError: The arm cannot be used, or a joint could not be released.
        OSError: The socket cannot be made, or standard output cannot be written.
    """
    output, parameters = Output(), parameters_from(options)
    settings = ServeSettings(
        name=options.name,
        bus=options.bus,
        overlay=options.parameters,
        evidence=options.evidence,
        table=table_file(options),
        scene=_existing(options.scene),
        bench=_state_folder() / f"{options.name}@{options.bus.replace('/', '_')}.json",
        group=options.group,
        gateways=[_with_one_address(words) for words in options.gateways],
        priority=options.priority,
        speed=options.speed,
    )
    if options.speed != 1.0 and options.bus != "sim":
        raise InvalidArgumentError("--speed applies only to the arm simulated in this process")
    log.set_up(as_json=options.json)
    claim = OwnerClaim(settings.name, settings.bus)

    def ready(owner: Owner) -> None:
        output.line(f"arm: {owner.robot.description}")
        output.line(f"{settings.name} is served: bioscara status --arm {settings.name}")

    async def until_signal() -> None:
        loop, ended = asyncio.get_running_loop(), asyncio.Event()
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            loop.add_signal_handler(number, ended.set)
        if early.requested:
            ended.set()
        await serve(robot, settings, claim, ended, ready)

    try:
        if options.bus == "sim":
            robot = Robot.simulated(
                parameters,
                v1=options.v1,
                seed=options.seed,
                homed=options.homed,
                rate=options.rate,
                evidence=options.evidence,
            )
        else:
            robot = Robot.on_bus(
                options.bus, parameters, rate=options.rate, evidence=options.evidence
            )
        # Connecting reports to systemd that the service is ready: a signal may come from then on.
        with StopRequest() as early, robot:
            asyncio.run(until_signal())
    finally:
        claim.close()
    output.line(f"{settings.name} is not served any more; its joints are released")
    output.check()
    return ExitStatus.OK
