"""STOP on the second socket of an owner, which its control loop reads itself.

For a STOP that the process of the clients does not answer. Imports the standard library
and modules that do so only, as ``bioscara stop`` must be fast.
"""

from __future__ import annotations

import json
import os
import socket

from bioscara.api import runtime
from bioscara.errors import OwnerLostError

USUAL = 0.2
"""Time after which a STOP without an answer is sent here [s]."""
LONGEST = 4096
"""Longest message [byte]."""
_PATIENCE = 1.0
"""Time in which the owner has to confirm [s]: a control cycle, on a busy computer."""


def packet(client: str, session: str) -> bytes:
    """Return the message of a client that stops all motion.

    Args:
        client: Its name.
        session: Its session; that of the client that commands the arm keeps the lease.
    """
    return json.dumps({"kind": "stop", "client": client, "session": session}).encode()


def stop_directly(owner: runtime.OwnerEntry, client: str, session: str) -> None:
    """Stop all motion of an arm.

    Args:
        owner: Its owner.
        client: Name of the client.
        session: Its session.

    Raises:
        AccessError: Another user's process listens there.
        OwnerLostError: The owner did not confirm it.
    """
    problem = f"it did not confirm STOP in {_PATIENCE:g} s"
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as connection:
        try:
            connection.settimeout(_PATIENCE)
            connection.connect(os.fspath(owner.stop_socket))
            runtime.require_trusted(connection, owner.stop_socket)
            connection.send(packet(client, session))
            if connection.recv(LONGEST):
                return
            problem = "it ended the connection"
        except TimeoutError:
            pass
        except OSError as error:
            problem = error.strerror or str(error)
    raise OwnerLostError(f"the owner of arm {owner.name} cannot be reached by its loop: {problem}")
