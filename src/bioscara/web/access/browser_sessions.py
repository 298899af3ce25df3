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
IDLE = 3600.0
"""Time without a request or message after which it has to do so, too [s]."""
MOST = 128
"""Number of browsers of a scope that may be signed in; the oldest of them is signed out."""


@dataclass(slots=True)
class BrowserSession:
    """A browser that has signed in.

    Attributes:
        scope: Its rights.
        until: When it expires, on the clock of the sessions [s].
        used: When its last request or message came, likewise [s].
        ended: Set when the browser signs out, or is signed out.
    """

    scope: Scope
    until: float
    used: float
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
        value, now = secrets.token_urlsafe(32), self._clock()
        self._sessions[_key(value)] = BrowserSession(scope, now + LIFETIME, now)
        # Of its own scope alone: a viewer must not sign out an operator.
        own = [key for key, session in self._sessions.items() if session.scope == scope]
        for key in own[:-MOST]:
            self._sessions.pop(key).ended.set()
        return value

    def find(self, value: str) -> BrowserSession | None:
        """Return the session of a cookie's value, which is used; None if there is none any more."""
        session = self._sessions.get(_key(value))
        if session is not None and self.remaining(session) <= 0.0:
            self.end(value)
            return None
        if session is not None:
            self.use(session)
        return session

    def use(self, session: BrowserSession) -> None:
        """Keep the time of a request or message of a browser."""
        session.used = self._clock()

    def end(self, value: str) -> None:
        """Sign a browser out."""
        session = self._sessions.pop(_key(value), None)
        if session is not None:
            session.ended.set()

    def remaining(self, session: BrowserSession) -> float:
        """Return the time until a session expires if its browser sends nothing more [s]."""
        return min(session.until, session.used + IDLE) - self._clock()

    async def ended(self, session: BrowserSession) -> str:
        """Wait until a session has ended; return why."""
        while (remaining := self.remaining(session)) > 0.0:
            try:
                await asyncio.wait_for(session.ended.wait(), remaining)
            except TimeoutError:
                continue
            return "signed out"
        return "the sign-in has expired"


def _key(value: str) -> bytes:
    return hashlib.sha256(value.encode()).digest()
