"""Pauses of all motion: each has an author, and motion continues when none is left."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from bioscara.errors import BusyOwnerError, LeaseError
from bioscara.robot.arm import Arm
from bioscara.server.clients.client import Client
from bioscara.server.clients.lease import Lease

AUTHORS = 32
"""Largest number of clients whose pauses are kept: each sample names them."""


class _Author(NamedTuple):
    """Who paused.

    Attributes:
        client: The client.
        may_resume: Whether it may lift its pause: it may operate the arm.
    """

    client: Client
    may_resume: bool


class Pauses:
    """Decides which clients may lift the pauses of an arm.

    A pause is lifted by its author, or by the holder of the lease. One whose author has
    disconnected stays: a person may rely on it, such as one who reaches into the cell. A client of
    the same name then counts as the author: a page that was loaded again, or the next command of
    the same user.

    Args:
        arm: The arm, which keeps the pauses and ends them with a stop.
        lease: Its lease.
    """

    def __init__(self, arm: Arm, lease: Lease) -> None:
        self._arm, self._lease = arm, lease
        self._authors: dict[str, _Author] = {}

    def begin(self, client: Client, *, may_resume: bool) -> bool:
        """Pause all motion; return whether the client had not paused it yet.

        Args:
            client: The author.
            may_resume: Whether it may lift the pause.

        Raises:
            BusyOwnerError: Too many clients have paused it already.
        """
        before = self._arm.pauses
        if client.session not in before and len(before) >= AUTHORS:
            raise BusyOwnerError(
                f"the arm is paused by {AUTHORS} clients already, and stays paused until each of "
                "them, or the holder of the lease, resumes it"
            )
        self._arm.pause(client.session, client.name)
        kept = self._arm.pauses
        authors = {**self._authors, client.session: _Author(client, may_resume)}
        self._authors = {key: author for key, author in authors.items() if key in kept}
        return client.session not in before

    def lift(self, client: Client) -> tuple[str, ...]:
        """Lift all pauses that a client may lift, and return the names of their authors.

        Raises:
            LeaseError: The arm is paused, and it may lift no pause; names the clients that can.
        """
        pauses = self._arm.pauses
        commands = self._lease.holder == client.session
        lifted = [key for key in pauses if commands or self._is_author(client, key)]
        if pauses and not lifted:
            raise LeaseError(self._refusal(pauses), self._lease.client)
        for key in lifted:
            self._arm.resume(key)
        return tuple(pauses[key] for key in lifted)

    def _is_author(self, client: Client, key: str) -> bool:
        author = self._authors.get(key)
        if author is None or not author.may_resume:
            return False
        return key == client.session or (
            author.client.name == client.name and not author.client.connected
        )

    def _refusal(self, pauses: dict[str, str]) -> str:
        """Return the authors of the pauses and the clients that can resume."""
        words, able, holder = [], [], self._lease.client
        for key, name in pauses.items():
            author = self._authors.get(key)
            gone = author is not None and not author.client.connected
            words.append(f"'{name}' (not connected)" if gone else f"'{name}'")
            if author is not None and author.may_resume and name != holder:
                able.append(name)
        paused = f"paused by {joined(words)}"
        if not holder:
            taker = "the client that takes the lease"
            able_words = f"{joined(able)} can resume, or {taker}" if able else f"{taker} can resume"
            return f"{paused}; {able_words}"
        if not able:
            return (
                f"{paused}; only the holder of the lease, '{holder}', can resume; 'bioscara lease "
                "--end' takes the lease from it, which ends its motion"
            )
        return f"{paused}; {joined(able)} or the holder of the lease, '{holder}', can resume"


def joined(names: Sequence[str]) -> str:
    """Return names as a list in words, each once."""
    *others, last = dict.fromkeys(names)
    return f"{', '.join(others)} and {last}" if others else last
