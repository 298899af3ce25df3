"""``bioscara view``."""

from __future__ import annotations

import socket
from contextlib import suppress
from typing import TYPE_CHECKING

from bioscara.cli.commands.serving.web import require_packages
from bioscara.cli.output.console import Output
from bioscara.cli.parser import Options, Parser
from bioscara.cli.shared_arguments import FINGERS, share, share_scene, share_target
from bioscara.errors import ConfigurationError, InvalidArgumentError

if TYPE_CHECKING:
    from bioscara.web.gateway import PageServer


def arguments(parser: Parser) -> None:
    share(parser, "--parameters")
    parser.add_argument(
        "source",
        metavar="SOURCE",
        nargs="?",
        help="folder of a run, recording, trajectory file, sim:/path.sock for the arm that "
        "'bioscara simulate' runs, while a program uses it, or arm:NAME for one that "
        "'bioscara serve' runs (default: sliders, or the plan to the target)",
    )
    share(parser, "--from", help="joint positions at the start of the plan")
    share_target(parser, required=False)
    share(parser, "--full-speed", "--deg")
    share(
        parser,
        "--port",
        help="TCP port to listen on (default 8080); the next free one is taken if it is in use",
    )
    share_scene(parser, help="file with the zones and the table to show")
    parser.checks.append(_check)


def _check(parser: Parser, options: Options) -> None:
    """Refuse options of ``view`` that exclude one another."""
    planned = has_target(options)
    if planned and options.source is not None:
        parser.error(f"{options.source} and a target exclude one another; leave out one of them")
    given = {
        "--from": options.start is not None,
        "--table": options.table is not None,
        "--tool": options.tool != FINGERS,
        "--linear": options.linear,
        "--via": options.via is not None,
        "--velocity-scaling": options.velocity_scaling != 1.0,
        "--full-speed": options.full_speed,
    }
    for word, is_given in given.items():
        if is_given and not planned:
            parser.error(f"{word} applies to a planned motion; add --pose, --joints or --name")


def has_target(options: Options) -> bool:
    """Return whether a planned motion is to be shown."""
    return bool(options.name) or options.pose is not None or options.joints is not None


def run(options: Options, output: Output) -> None:
    """Show the arm in the browser until Ctrl-C.

    Raises:
        ConfigurationError: A package is missing, no port is free, or a file cannot be read.
        InvalidArgumentError: The source cannot be shown.
        BioscaraError: The motion cannot be planned, or there is no arm to look at.
    """
    require_packages()
    from bioscara.cli.signals import StopRequest
    from bioscara.processes.unread_output import never_wait
    from bioscara.server import log

    never_wait()
    log.set_up(as_json=False)
    with StopRequest() as cancelled:
        server, address = _server(options)
        output.line(f"the arm in 3D: {address} (from this computer only; Ctrl-C ends it)")
        server.run(cancelled)


def _server(options: Options) -> tuple[PageServer, str]:
    """Return what serves the page, and its address.

    Raises:
        BioscaraError: There is nothing to show, for a reason that the message gives.
    """
    from bioscara.cli.arm_parameters import parameters_from
    from bioscara.cli.view_source import SERVED, is_arm, onlooker_of, viewed_from
    from bioscara.robot.tasks.scope import Scope
    from bioscara.web.gateway import LOOPBACK, Gateway, GatewaySettings
    from bioscara.web.viewer import ViewServer

    source, port = options.source, _first_free(LOOPBACK, options.port)
    if source is not None and source.startswith(SERVED):
        if options.surroundings is not None:
            word = "--scene" if options.world is None else "--world"
            raise InvalidArgumentError(
                f"{word}: {source} is shown in the scene of its owner; leave it out"
            )
        name = source.removeprefix(SERVED)
        gateway = Gateway(GatewaySettings(name, port=port, read_only=True))
        return gateway, gateway.url_with_token(Scope.VIEW)
    look = onlooker_of(source).look if source is not None and is_arm(source) else None
    server = ViewServer(port, viewed_from(options, parameters_from(options)), look)
    return server, server.url


def _first_free(host: str, port: int) -> int:
    """Return the first free port from ``port`` on."""
    for candidate in range(port, 2**16):
        with socket.socket() as probe:
            # As servers do: a port that the last page left in TIME_WAIT counts as free.
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            with suppress(OSError):
                probe.bind((host, candidate))
                return candidate
    raise ConfigurationError(f"no port from {port} on is free; choose a lower one")
