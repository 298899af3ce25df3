"""Browsers that have signed in: the random values of their cookies, until they expire."""

from __future__ import annotations

import asyncio
import hashlib
import secrets
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from bioscara.robot.tasks.scope import Scope

LIFETIME = 12 * 3600.0
"""Time after which a browser has to sign in again [s]."""
MOST = 128
"""Number of browsers of a scope that may be signed in; the oldest of them is signed out."""


@dataclass(slots=True)
class BrowserSession:
    """A browser that has signed in.

    Attributes:
        scope: Its rights.
        until: When it expires, on the clock of the sessions [s].
        ended: Set when the browser signs out, or is signed out.
    """

    scope: Scope
    until: float
    ended: asyncio.Event = field(default_factory=asyncio.Event)


class BrowserSessions:
    """The signed-in browsers, in memory only; used in one thread.

    Args:
        clock: Returns the time [s].
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        # By their hashes: the duration of a search then reveals nothing of the values.
        self._sessions: dict[bytes, BrowserSession] = {}

    def begin(self, scope: Scope) -> str:
        """Sign a browser in; returns the value of its cookie."""
        value = secrets.token_urlsafe(32)
        self._sessions[_key(value)] = BrowserSession(scope, self._clock() + LIFETIME)
        # Of its own scope alone: a viewer must not sign out an operator.
        own = [key for key, session in self._sessions.items() if session.scope == scope]
        for key in own[:-MOST]:
            self._sessions.pop(key).ended.set()
        return value

    def find(self, value: str) -> BrowserSession | None:
        """Return the session of a cookie's value; None if there is none, or it has expired."""
        session = self._sessions.get(_key(value))
        if session is not None and self.remaining(session) <= 0.0:
            self.end(value)
            return None
        return session

    def end(self, value: str) -> None:
        """Sign a browser out."""
        session = self._sessions.pop(_key(value), None)
        if session is not None:
            session.ended.set()

    def remaining(self, session: BrowserSession) -> float:
        """Return the time until a session expires [s]."""
        return session.until - self._clock()


def _key(value: str) -> bytes:
    return hashlib.sha256(value.encode()).digest()
