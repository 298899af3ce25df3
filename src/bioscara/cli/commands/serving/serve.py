"""``bioscara serve``."""

from __future__ import annotations

import argparse
import os
import shlex
from pathlib import Path
from typing import TYPE_CHECKING

from bioscara.cli.arm_choice import share_arm
from bioscara.cli.output.console import Output
from bioscara.cli.parser import Options, Parser, number, parse
from bioscara.cli.shared_arguments import share, share_scene
from bioscara.errors import ConfigurationError, InvalidArgumentError
from bioscara.spelling import did_you_mean

if TYPE_CHECKING:
    from bioscara.server.owner import Owner

_GATEWAYS = ("web", "record", "ros")
"""Commands that an owner can start."""


def arguments(parser: Parser) -> None:
    share(parser, "--parameters")
    share_arm(parser, owned=False)
    parser.add_argument(
        "--name", metavar="NAME", default="arm", help="name of the arm for clients (default: arm)"
    )
    share(parser, "--rate", "--priority")
    parser.add_argument(
        "--real-time-factor",
        metavar="N",
        type=number,
        default=1.0,
        help="let the arm simulated in this process be N times as fast as real time (default 1)",
    )
    parser.add_argument(
        "--with",
        dest="gateways",
        metavar="LIST",
        type=_gateways,
        action="extend",
        default=[],
        help="also run these gateways, as web,record or 'web --port 9000' with options; repeatable",
    )
    parser.add_argument(
        "--group",
        metavar="GROUP",
        default="",
        help="let the members of this group be clients, too (default: this user alone)",
    )
    parser.add_argument(
        "--evidence",
        metavar="DIR",
        type=Path,
        default=Path("faults"),
        help="folder for the flight records of faults (default: faults)",
    )
    share(
        parser, "--table", help="file with the poses, in which those that clients teach are saved"
    )
    share_scene(
        parser,
        help="file with the zones and the table; a scene that a client sets is saved in it",
    )
    parser.add_argument("--json", action="store_true", help="write the log as JSON")
    share(parser, "--seed", help="seed of the simulation")
    share(parser, "--homed")
    parser.checks.append(_check_gateways)


def _gateways(word: str) -> list[tuple[str, ...]]:
    """Return the words of the gateways in an argument: their names, or one name with options."""
    try:
        words = shlex.split(word)
    except ValueError as error:
        text = f"{word.strip()!r} cannot be read: {str(error).lower()}"
        raise argparse.ArgumentTypeError(text) from None
    found: list[tuple[str, ...]] = [(name,) for name in word.split(",") if name]
    if len(words) > 1:
        found = [tuple(words)]
    for name, *_ in found:
        if name not in _GATEWAYS:
            hint = did_you_mean(name, _GATEWAYS, f"there are {', '.join(_GATEWAYS)}")
            raise argparse.ArgumentTypeError(f"there is no gateway {name!r}; {hint}")
    return found


def _check_gateways(_: Parser, options: Options) -> None:
    """Refuse wrong options here, and not each time that the owner starts the gateway."""
    for name, *words in options.gateways:
        parse([name, "--arm", options.name, *words])


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
    """Return the folder of the state for the next owner: of the service, or of this user."""
    if service := os.environ.get("STATE_DIRECTORY"):
        return Path(service.split(":")[0])
    return Path(os.environ.get("XDG_STATE_HOME") or "~/.local/state").expanduser() / "bioscara"


def run(options: Options, output: Output) -> None:
    """Own an arm until Ctrl-C or SIGTERM; it is at rest and released then.

    Raises:
        BusyOwnerError: An owner of that name runs.
        BioscaraError: The arm cannot be used, or a joint could not be released.
        OSError: The socket cannot be made.
    """
    import asyncio
    import signal

    from bioscara.api.runtime import OwnerClaim
    from bioscara.cli.arm_parameters import parameters_from
    from bioscara.cli.signals import StopRequest
    from bioscara.cli.teach_table import table_file
    from bioscara.connect import Robot
    from bioscara.planning.world import read_world
    from bioscara.processes.nursery import start_early
    from bioscara.processes.unread_output import never_wait
    from bioscara.server import log
    from bioscara.server.channel.api_process import MODULES
    from bioscara.server.serve import ServeSettings, serve

    # First: nothing is open yet, and no thread runs.
    never_wait(lambda: start_early(MODULES, fork=True))
    parameters = parameters_from(options)
    settings = ServeSettings(
        name=options.name,
        bus=options.bus,
        overlay=options.parameters,
        evidence=options.evidence,
        table=table_file(options),
        scene=_existing(options.scene),
        declared=None if options.world is None else read_world(options.world).planned,
        bench=_state_folder() / f"{options.name}@{options.bus.replace('/', '_')}.json",
        group=options.group,
        gateways=[_with_one_address(words) for words in options.gateways],
        priority=options.priority,
        real_time_factor=options.real_time_factor,
    )
    if options.real_time_factor != 1.0 and options.bus != "sim":
        raise InvalidArgumentError(
            "--real-time-factor applies only to the arm simulated in this process"
        )
    log.set_up(as_json=options.json)
    claim = OwnerClaim(settings.name, settings.bus, shared=bool(settings.group))

    def ready(owner: Owner) -> None:
        output.line(f"arm: {owner.robot.description}")
        if settings.overlay is None:
            output.line("parameters: those of the existing arms")
        around = ("scene", settings.scene) if options.world is None else ("world", options.world)
        for what, path in (("table", settings.table), around):
            output.line(f"{what}: {path.absolute() if path else 'none'}")
        output.line(f"{settings.name} is served: bioscara status --arm {settings.name}")

    async def until_signal() -> None:
        loop, ended = asyncio.get_running_loop(), asyncio.Event()
        for each in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            loop.add_signal_handler(each, ended.set)
        if early.requested:
            ended.set()
        await serve(robot, settings, claim, ended, ready)

    try:
        if options.bus == "sim":
            robot = Robot.simulated(
                parameters,
                v1=options.v1,
                world=options.world,
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
