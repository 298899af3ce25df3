"""``bioscara stop [NAME]``: stop the motion of served arms, without delay.

Imports the standard library, and modules of this package that do so: a process of Python that
imports numpy needs longer to start than the arm to come to rest.
"""

from __future__ import annotations

import json
import os
import socket
import sys
from collections.abc import Sequence

from bioscara.api import runtime
from bioscara.errors import BioscaraError

_VERSION = 1
"""Version of the messages, as in :mod:`bioscara.api.messages`."""
_ANSWER_TIMEOUT = 1.0
"""Time in which an owner has to confirm [s]."""


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
    # It is sent to all before the first answer is waited for.
    connections = [(owner, _send(owner)) for owner in owners]
    failed = False
    for owner, connection in connections:
        problem = _confirmed(connection) if not isinstance(connection, Exception) else connection
        if problem is None:
            sys.stdout.write(f"{owner.name} was stopped\n")
        else:
            failed = True
            sys.stderr.write(
                f"bioscara: {owner.name} may not have been stopped: {problem}; use the emergency "
                f"stop, or end process {owner.pid}\n"
            )
    return 1 if failed else 0


def _send(owner: runtime.OwnerEntry) -> socket.socket | Exception:
    """Send STOP to an owner; return the connection, or why it was not sent."""
    hello = {
        "kind": "hello",
        "version": _VERSION,
        "client": f"bioscara stop[{os.getpid()}]",
        "session": os.urandom(16).hex(),
    }
    request = {"kind": "request", "id": 1, "command": {"kind": "stop"}}
    connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        connection.settimeout(_ANSWER_TIMEOUT)
        connection.connect(os.fspath(owner.socket))
        runtime.require_trusted(connection, owner.socket)
        connection.sendall(b"".join(map(_framed, (hello, request))))
    except (OSError, BioscaraError) as error:
        connection.close()
        return error
    return connection


def _framed(message: dict[str, object]) -> bytes:
    text = json.dumps(message).encode()
    return len(text).to_bytes(4, "big") + text


def _confirmed(connection: socket.socket) -> Exception | None:
    """Wait for the answer to STOP; return None, or why it is not confirmed."""
    with connection, connection.makefile("rb") as answers:
        try:
            while len(head := answers.read(4)) == 4:
                answer = json.loads(answers.read(int.from_bytes(head, "big")))
                if answer.get("kind") == "response":
                    return None
                if answer.get("kind") == "refusal":
                    return BioscaraError(answer["failure"]["text"])
        except (OSError, ValueError) as error:
            return error
    return BioscaraError("its owner ended the connection")


__all__ = ["main"]
