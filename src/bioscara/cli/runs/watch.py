"""The demonstration in the browser: a simulated arm, served with its page until Ctrl-C."""

from __future__ import annotations

import logging
import os
import sys
import time
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Thread

from bioscara.api import runtime
from bioscara.api.gateway_pages import page_of
from bioscara.cli.commands.serving.web import require_packages
from bioscara.cli.output.console import ExitStatus, Output
from bioscara.cli.parser import Options
from bioscara.cli.shared_arguments import TABLE
from bioscara.cli.signals import StopRequest
from bioscara.connect import Robot
from bioscara.errors import ConfigurationError, InvalidArgumentError, OwnerLostError
from bioscara.model import ArmParameters
from bioscara.processes.unread_output import never_wait
from bioscara.server import log
from bioscara.server.serve import ServeSettings, serving

NAME = "demo"
"""Name of the served arm."""
_GATEWAY = ("web", "--port", "0", "--show", "operate")
_PATIENCE = 30.0
"""Time in which the gateway has to begin [s]."""
_POLL = 0.02
_SCREENS = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
"""Variables of the environment without which a browser would begin in the terminal, if at all."""


def watch(
    demonstrate: Callable[[], ExitStatus],
    parameters: ArmParameters,
    options: Options,
    output: Output,
) -> ExitStatus:
    """Serve a simulated arm with its page, show it, demonstrate, and serve it until Ctrl-C.

    Args:
        demonstrate: Moves the arm that ``options.arm`` names then.
        parameters: Parameters of the arm.
        options: Parsed options.
        output: Output for messages to the user.

    Raises:
        InvalidArgumentError: The arm is not the simulated one.
        ConfigurationError: The packages of the gateway are not installed, or the file with the
            poses cannot be read.
        BusyOwnerError: Another one runs already.
        BioscaraError: The arm cannot be served.
    """
    if options.bus != "sim":
        raise InvalidArgumentError(
            "--watch serves the arm simulated in this process; for another one: bioscara serve "
            f"--bus {options.bus} --with web"
        )
    require_packages()
    never_wait()
    log.set_up(as_json=False, least=logging.WARNING)  # not into the display of the motion
    settings = ServeSettings(
        NAME,
        options.bus,
        overlay=options.parameters,
        table=TABLE,
        declared=None if options.world is None else options.world.planned,
        gateways=(_GATEWAY,),
        priority=options.priority,
    )
    with Robot.simulated(
        parameters, v1=options.v1, world=options.world, rate=options.rate
    ) as robot:
        # Before it is served: in its own time, which is not that of the page.
        robot.home()
        with serving(robot, settings), _shown(_address()) as url:
            output.line(f"the simulated arm in the browser: {url}")
            # The priority is that of the owner's control loop, not of its client.
            options.arm, options.priority = NAME, None
            options.scene = options.world = None
            status = demonstrate()
            if status is ExitStatus.INTERRUPTED:
                return status
            output.line(f"served until Ctrl-C; take control in the browser to move it: {url}")
            with StopRequest() as ended:
                while not ended():
                    time.sleep(_POLL)
    return status


def _address() -> str:
    """Return the address of the page once its gateway listens, with the token to operate.

    Raises:
        OwnerLostError: It does not begin.
    """
    # Imported here: installed by an extra.
    from bioscara.robot.tasks.scope import Scope  # noqa: PLC0415
    from bioscara.web.access.tokens import default_path, load_tokens  # noqa: PLC0415

    end = time.monotonic() + _PATIENCE
    while (url := page_of(NAME)) is None:
        if time.monotonic() > end:
            raise OwnerLostError(f"the gateway of {NAME} did not begin in {_PATIENCE:g} s")
        time.sleep(_POLL)
    return f"{url}#token={load_tokens(default_path(NAME)).of(Scope.OPERATE)}"


@contextmanager
def _shown(address: str) -> Iterator[str]:
    """Open an address in the browser, where there is a screen; yield the part that may be printed.

    The browser gets a file that leads there: other users can see the arguments of its process, and
    the token must not be among them.
    """
    # Of a service the output is a log, which others may read.
    url = address if sys.stdout.isatty() else address.partition("#")[0]
    if not any(os.environ.get(name) for name in _SCREENS):
        yield url
        return
    path = runtime.folder() / f"{NAME}.open.html"
    page = f'<!doctype html><meta http-equiv="refresh" content="0; url={address}">\n'
    try:
        path.unlink(missing_ok=True)
        _write_private(path, page)
    except OSError as error:
        raise ConfigurationError(f"{path}: {error.strerror}; remove that") from error
    try:
        # In a thread: some browsers end only when their window is closed.
        Thread(target=_open, args=(path.as_uri(),), daemon=True).start()
        yield url
    finally:
        path.unlink(missing_ok=True)


def _open(address: str) -> None:
    with suppress(webbrowser.Error):
        webbrowser.open(address)


def _write_private(path: Path, text: str) -> None:
    file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
    with os.fdopen(file, "w", encoding="utf-8") as stream:
        stream.write(text)
