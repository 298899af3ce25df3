"""Preconditions of a motion: session open, motor enabled, homed, no blocking command."""

from __future__ import annotations

from bioscara.drivers.joint.feedback import EncoderFeedback
from bioscara.drivers.link.session import Session
from bioscara.errors import IncorrectStateError, NotEnabledError, NotHomedError, StalledError
from bioscara.protocol import Flags, Register

# A plain number: an operation on an IntFlag costs more than the rest of an exchange.
_OBSTACLES = int(Flags.STALL | Flags.NOTENABLED | Flags.NOTHOMED)
_NONE = Register.NONE


class Readiness:
    """Whether one joint can move, by the flags in its last answer; nothing is sent.

    Attributes:
        blocking: The blocking command that was started here and has not ended.
    """

    __slots__ = ("_feedback", "_name", "_session", "blocking")

    def __init__(self, name: str, session: Session, feedback: EncoderFeedback) -> None:
        self._name, self._session, self._feedback = name, session, feedback
        self.blocking = Register.NONE

    def is_ready(self) -> bool:
        """Return whether :meth:`require_ready` would return."""
        session = self._session
        return (
            session.version != 0
            and not session.flags & _OBSTACLES
            and self._feedback.offset_known
            and self.blocking is _NONE
        )

    def require_ready(self, *, homed: bool = True) -> None:
        """Raise unless the joint was initialised and can move.

        Args:
            homed: Whether it must be homed.

        Raises:
            NotInitializedError, JointResetError, NotEnabledError, NotHomedError, StalledError,
            IncorrectStateError: The condition that prevents a motion.
        """
        self.require_idle()
        name, flags = self._name, self._session.flags
        if flags & Flags.STALL:
            remedy = "remove the obstacle, then clear_stall()"
            raise StalledError(f"{name}: the joint stalled", name, remedy)
        if flags & Flags.NOTENABLED:
            raise NotEnabledError(f"{name}: it is not enabled", name, "enable() first")
        if homed and (flags & Flags.NOTHOMED or not self._feedback.offset_known):
            raise NotHomedError(f"{name}: it is not homed; home() first", name)

    def require_idle(self) -> None:
        """Raise unless the joint was initialised and runs no blocking command.

        Raises:
            NotInitializedError, JointResetError, IncorrectStateError: The reason.
        """
        self._session.require_open()
        if self.blocking is not Register.NONE:
            raise IncorrectStateError(
                f"{self._name}: {self.blocking.name} is running; let it end or stop() it",
                self._name,
            )
