"""Preconditions of a motion: session open, no fault, motor enabled, homed, no blocking command."""

from __future__ import annotations

from bioscara.drivers.joint.feedback import EncoderFeedback
from bioscara.drivers.link.errors import fault_error
from bioscara.drivers.link.joint_reports import FaultReport
from bioscara.drivers.link.session import Session
from bioscara.errors import IncorrectStateError, NotEnabledError, NotHomedError, StalledError
from bioscara.protocol import Fault, Flags, Register

# A plain number: an operation on an IntFlag costs more than the rest of an exchange.
_OBSTACLES = int(Flags.STALL | Flags.NOTENABLED | Flags.NOTHOMED | Flags.FAULT)
_NONE = Register.NONE


class Readiness:
    """Whether one joint can move, by the flags in its last answer; only its fault is requested.

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
            NotInitializedError, JointResetError, JointFaultError, StalledError, NotEnabledError,
            NotHomedError, IncorrectStateError: The condition that prevents a motion.
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

    def raise_fault(self) -> None:
        """Raise the latched fault, if the last flags of a version 2 joint show one."""
        if self._session.version == 2 and self._session.flags & Flags.FAULT:
            report = FaultReport.from_answer(self._session.read(Register.FAULT))
            if report.fault != Fault.NONE.name:
                raise fault_error(self._name, report)

    def require_idle(self) -> None:
        """Raise unless the joint was initialised, has no fault and runs no blocking command.

        A fault comes first: it has disabled the joint, and ended a command that is not completed.

        Raises:
            NotInitializedError, JointResetError, JointFaultError, StalledError,
            IncorrectStateError: The reason.
            CommunicationError: The joint did not answer which fault it has.
        """
        self._session.require_open()
        self.raise_fault()
        self.require_no_command()

    def require_no_command(self) -> None:
        """Raise if a blocking command is running.

        Raises:
            IncorrectStateError: One is.
        """
        if self.blocking is not _NONE:
            raise IncorrectStateError(
                f"{self._name}: {self.blocking.name} is running; let it end or stop() it",
                self._name,
            )
