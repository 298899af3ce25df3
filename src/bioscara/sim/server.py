"""A simulated arm that lives in a process of its own, in real time."""

from __future__ import annotations

import contextlib
import os
import selectors
import socket
import stat
from collections.abc import Callable
from pathlib import Path

from bioscara.clock import Clock, MonotonicClock
from bioscara.errors import BusUnavailableError
from bioscara.sim.arm import SimulatedArm
from bioscara.sim.framing import encode_reply, receive_request

_STEP = 0.002
"""How far simulated time may lag behind real time while nobody asks for anything [s]."""
_LAG_MAX = 0.25
"""Lag that is made up for; after more, as when the machine slept, time is not caught up [s]."""
_CLIENT_TIMEOUT = 1.0


def serve(
    arm: SimulatedArm,
    path: str | Path,
    cancelled: Callable[[], bool],
    clock: Clock | None = None,
    listening: Callable[[], None] = lambda: None,
) -> None:
    """Let the arm live behind a Unix socket until ``cancelled``.

    One client after another; the joints go on living when a client vanishes, which is the point.
    The socket is its owner's alone.

    Args:
        arm: The arm.
        path: Where the socket is made; a socket that nobody listens on is replaced.
        cancelled: Asked every few milliseconds.
        clock: Real time.
        listening: Called once clients can connect.

    Raises:
        BusUnavailableError: The socket cannot be made, or somebody listens there.
    """
    wall = MonotonicClock() if clock is None else clock
    path = str(path)
    listener = _listen(path)
    try:
        listening()
        with selectors.DefaultSelector() as selector:
            selector.register(listener, selectors.EVENT_READ)
            lead = wall.now() - arm.now()
            while not cancelled():
                ready = selector.select(_STEP)
                lead = _catch_up(arm, wall, lead)
                for key, _ in ready:
                    if key.fileobj is listener:
                        _accept(listener, selector)
                    else:
                        _answer(arm, key.fileobj, selector, wall, lead)
            for key in list(selector.get_map().values()):
                _hang_up(key.fileobj)
    finally:
        listener.close()
        with contextlib.suppress(FileNotFoundError):
            os.unlink(path)


def _catch_up(arm: SimulatedArm, wall: Clock, lead: float) -> float:
    lag = wall.now() - lead - arm.now()
    if lag > _LAG_MAX:
        lead += lag - _STEP
        lag = _STEP
    if lag > 0.0:
        arm.run(lag)
    return lead


def _listen(path: str) -> socket.socket:
    if _is_socket(path) and not _alive(path):
        os.unlink(path)
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    mask = os.umask(0o177)
    try:
        listener.bind(path)
    except OSError as error:
        listener.close()
        raise BusUnavailableError(
            f"cannot make the socket {path}: {error.strerror or error}; choose another path with "
            f"--socket, or end the arm that listens there"
        ) from error
    finally:
        os.umask(mask)
    listener.listen(1)
    return listener


def _is_socket(path: str) -> bool:
    try:
        return stat.S_ISSOCK(os.lstat(path).st_mode)
    except OSError:
        return False


def _alive(path: str) -> bool:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        try:
            probe.connect(path)
        except OSError:
            return False
    return True


def _accept(listener: socket.socket, selector: selectors.BaseSelector) -> None:
    connection, _ = listener.accept()
    # A client that stops in the middle of a request must not stop the arm.
    connection.settimeout(_CLIENT_TIMEOUT)
    selector.register(connection, selectors.EVENT_READ)


def _hang_up(connection: object) -> None:
    if isinstance(connection, socket.socket):
        connection.close()


def _answer(
    arm: SimulatedArm,
    connection: object,
    selector: selectors.BaseSelector,
    wall: Clock,
    lead: float,
) -> None:
    if not isinstance(connection, socket.socket):
        return
    try:
        reply = encode_reply(arm.transfer(receive_request(connection)))
        # The bus took its time: a client that asks on and on must not make the arm live faster.
        wall.sleep_until(arm.now() + lead)
        connection.sendall(reply)
    except (OSError, BusUnavailableError):
        selector.unregister(connection)
        connection.close()
