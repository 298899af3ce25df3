"""``bioscara view``."""

from __future__ import annotations

import socket
from contextlib import suppress
from typing import TYPE_CHECKING

from bioscara.cli.arm_parameters import parameters_from
from bioscara.cli.commands.serving.web import require_packages
from bioscara.cli.options import Options
from bioscara.cli.output.console import ExitStatus, Output
from bioscara.cli.signals import StopRequest
from bioscara.cli.view_source import SERVED, is_arm, onlooker_of, viewed_from
from bioscara.errors import ConfigurationError, InvalidArgumentError
from bioscara.server import log

if TYPE_CHECKING:
    from bioscara.web.gateway import PageServer


def run(options: Options) -> int:
    """Show the arm in the browser until Ctrl-C.

    Raises:
        ConfigurationError: A package is missing, no port is free, or a file cannot be read.
        InvalidArgumentError: The source cannot be shown.
        BioscaraError: The motion cannot be planned, or there is no arm to look at.
        OSError: Standard output cannot be written.
    """
    require_packages()
    output = Output()
    log.set_up(as_json=False)
    with StopRequest() as cancelled:
        server, address = _server(options)
        output.line(f"the arm in 3D: {address} (from this computer only; Ctrl-C ends it)")
        server.run(cancelled)
    output.check()
    return ExitStatus.OK


def _server(options: Options) -> tuple[PageServer, str]:
    """Return what serves the page, and its address.

    Raises:
        BioscaraError: There is nothing to show, for a reason that the message gives.
    """
    # Imported here: installed by an extra.
    from bioscara.robot.tasks.scope import Scope  # noqa: PLC0415
    from bioscara.web.gateway import LOOPBACK, Gateway, GatewaySettings  # noqa: PLC0415
    from bioscara.web.viewer import ViewServer  # noqa: PLC0415

    source, port = options.source, _first_free(LOOPBACK, options.port)
    if source is not None and source.startswith(SERVED):
        if options.scene is not None:
            raise InvalidArgumentError(
                f"--scene: {source} is shown in the scene of its owner; leave it out"
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
