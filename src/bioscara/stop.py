"""``bioscara stop [NAME]``: stop the motion of served arms, without delay.

Imports the standard library, and modules of this package that do so: a process of Python that
imports numpy needs longer to start than the arm to come to rest.
"""

from __future__ import annotations

import json
import os
import socket
import sys
import time
from collections.abc import Sequence

from bioscara.api import runtime
from bioscara.api.direct_stop import USUAL, stop_directly
from bioscara.errors import BioscaraError

_VERSION = 1
"""Version of the messages, as in :mod:`bioscara.api.messages`."""


def main(words: Sequence[str]) -> int:
    """Stop the arm of this name, or all arms that are served; return the exit status.

    Args:
        words: The name of an arm, or nothing.
    """
    try:
        owners = [runtime.find(words[0])] if words else runtime.owners()
    except BioscaraError as error:
        sys.stderr.write(f"bioscara: {error}\n")
        return 2
    if not owners:
        sys.stderr.write(f"bioscara: no arm is served, so none was stopped{runtime.unlisted()}\n")
        return 2
    client, session = f"bioscara stop[{os.getpid()}]", os.urandom(16).hex()
    # It is sent to all before the first answer is waited for.
    connections = [(owner, _sent(owner, client, session)) for owner in owners]
    end, failed = time.monotonic() + USUAL, False
    for owner, connection in connections:
        try:
            if isinstance(connection, BioscaraError):
                raise connection
            if not _is_confirmed(connection, end):
                stop_directly(owner, client, session)
        except (OSError, BioscaraError) as error:
            failed = True
            sys.stderr.write(
                f"bioscara: {owner.name} may not have been stopped: {error}; use the emergency "
                f"stop, or end process {owner.pid}\n"
            )
        else:
            sys.stdout.write(f"{owner.name} was stopped\n")
    return 1 if failed else 0


def _sent(
    owner: runtime.OwnerEntry, client: str, session: str
) -> socket.socket | BioscaraError | None:
    """Send STOP to an owner; return the connection, the refusal, or None if it takes nothing."""
    hello = {"kind": "hello", "version": _VERSION, "client": client, "session": session}
    request = {"kind": "request", "id": 1, "command": {"kind": "stop"}}
    connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        connection.settimeout(USUAL)
        connection.connect(os.fspath(owner.socket))
        runtime.require_trusted(connection, owner.socket)
        connection.sendall(b"".join(map(_framed, (hello, request))))
    except (OSError, BioscaraError) as error:
        connection.close()
        return error if isinstance(error, BioscaraError) else None
    return connection


def _framed(message: dict[str, object]) -> bytes:
    text = json.dumps(message).encode()
    return len(text).to_bytes(4, "big") + text


def _is_confirmed(connection: socket.socket | None, end: float) -> bool:
    """Wait for the answer to STOP until a time; return whether it has come."""
    if connection is None:
        return False
    with connection, connection.makefile("rb") as answers:
        try:
            connection.settimeout(max(end - time.monotonic(), 0.01))
            while len(head := answers.read(4)) == 4:
                answer = json.loads(answers.read(int.from_bytes(head, "big")))
                if answer.get("kind") in {"response", "refusal"}:
                    return bool(answer["kind"] == "response")
        except (OSError, ValueError):
            return False
    return False


__all__ = ["main"]
