"""Exceptions of the package, in one tree.

    BioscaraError
    ├── InvalidArgumentError          a caller's value (also a ValueError)
    │   ├── LimitError                ... outside a limit
    │   │   └── HomingSpeedError      ... a homing speed outside the range of the motor
    │   ├── UnreachableError          ... a pose that the arm cannot take
    │   │   └── PathError             ... within a path of the tool
    │   ├── ZoneError                 ... a path too close to an obstacle
    │   ├── TrajectoryError           ... a trajectory that cannot be executed
    │   ├── GoalRejectedError         ... a goal of a controller; nothing moved
    │   ├── ImageError                ... a firmware image; nothing was written
    │   └── ConfigurationError        ... a configuration value or file
    ├── CommunicationError            the exchange with a device failed
    │   ├── NoAcknowledgeError        no device acknowledged the address
    │   ├── BusTimeoutError           the transfer did not end in time
    │   ├── BusStuckError             a line is held low
    │   ├── CorruptFrameError         an answer failed its check
    │   ├── RefusedError              the joint understood and refused
    │   ├── JointLostError            a joint failed several cycles in a row
    │   └── BusUnavailableError       the bus cannot be opened
    ├── JointError                    the state of a joint forbids it
    │   ├── NotInitializedError, NotEnabledError, NotHomedError, StalledError
    │   ├── IncorrectStateError       another blocking command is running
    │   ├── JointFaultError           a latched fault of the joint
    │   ├── FollowingError            it is too far from its commanded position
    │   ├── JointResetError           the joint restarted: its home is lost
    │   ├── WrongJointError           another joint answers at this address
    │   └── HomingError               homing ended without a home
    ├── ReplayError                   a replayed run differs from the recorded one
    ├── NotSupportedError             the joint's firmware cannot do it
    ├── FlashError                    a board cannot be flashed, or was not
    ├── GripperError                  the gripper or its PWM channel
    ├── HardwareError                 a hardware component and its lifecycle
    │   ├── LifecycleError            ... the transition does not exist in this state, or failed
    │   └── ModeSwitchError           ... the joints cannot take these command modes now
    ├── OverrunError                  the control loop did not keep its deadlines
    ├── RealtimeError                 the system denies the loop real-time priority
    ├── ControllerError               a controller raised, or its output is unusable
    ├── SwitchError                   loading, configuring or switching controllers was refused
    ├── GoalAbortedError              an accepted goal did not reach its end
    ├── FaultedError                  the arm is stopped by an unacknowledged fault
    ├── UnconfirmedError              the surroundings are those of the owner's last run
    ├── BusyError                     another call is using the arm
    ├── MotionTimeoutError            a motion took longer than it may
    ├── MotionCancelledError          a motion was cancelled
    │   └── JogExpiredError           a jog received no velocity in time
    ├── RecordingError                a recording cannot be written or read
    └── OwnerError                    the process that owns the arm, or the way to it
        ├── OwnerLostError            ... it does not run, or does not answer
        ├── BusyOwnerError            ... another one runs, or it has too much to do
        ├── LeaseError                ... another client commands the arm, or none does
        ├── ConflictError             ... another client has changed the value since
        ├── ProtocolError             ... a message cannot be understood
        ├── AccessError               ... this user or client may not do that
        └── EffortError               ... a request takes more time or memory than it may

Messages are one printable line: unprintable characters in external names are escaped, and the
middle of a text longer than 1000 characters is left out.

``code`` is the number that the original driver returned; errors that it did not have got numbers
from -200 down, which it never used. A number never changes its meaning; docs/errors.md lists all.
Errors that concern one thing carry it as attributes, so that a program can react without parsing
the message.
"""

from __future__ import annotations

from bioscara.printing import brief


class BioscaraError(Exception):
    """Base of every error that the package raises intentionally.

    Attributes:
        code: Number of the error, that of the original driver where it had one.
        evidence: File with the flight record of the fault that it stands for; None without one. Of
            a served arm it is that of the owner.
    """

    code = -200
    evidence: str | None = None

    def __str__(self) -> str:
        text = self.message
        return brief(f"{text} (evidence: {self.evidence})" if self.evidence else text)

    @property
    def message(self) -> str:
        """The text without the evidence."""
        return super().__str__()

    def _render_traceback_(self) -> list[str]:
        """Return the lines that IPython shows: the user's own, without the package's frames."""
        # Imported here: `bioscara stop` imports errors and must be fast.
        from bioscara.notebook import outer_traceback  # noqa: PLC0415

        return outer_traceback(self)


class InvalidArgumentError(BioscaraError, ValueError):
    """A value that a caller passed cannot be used; nothing was sent or moved."""

    code = -101


class LimitError(InvalidArgumentError):
    """A value is outside the limit that it must respect.

    Attributes:
        name: Name of the value, for example ``"j2 velocity"``.
        value: The refused value, SI units.
        lower: Lowest allowed value.
        upper: Highest allowed value.
    """

    def __init__(
        self, name: str, value: float, lower: float, upper: float, unit: str, remedy: str = ""
    ) -> None:
        self.name, self.value, self.lower, self.upper = name, value, lower, upper
        told = f" {unit}" if unit else ""
        text = f"{name}: {value:g}{told} is outside {lower:g} .. {upper:g}{told}"
        super().__init__(f"{text}; {remedy}" if remedy else text)


class HomingSpeedError(LimitError):
    """A homing speed is outside the motor speeds at which a joint can be homed."""

    code = -102


class TrajectoryError(InvalidArgumentError):
    """A trajectory, or the file that holds it, cannot be executed."""


class UnreachableError(InvalidArgumentError):
    """A pose is unreachable; the message states which joint or length is short by how much."""


class PathError(UnreachableError):
    """The arm cannot follow a path of its tool; nothing moved.

    Attributes:
        segment: Number of the path's piece, counted from 0.
        joint: Name of the joint that prevents it.
        position: Distance along the path [m].
        largest_speed: Highest tool speed possible there [m/s]; 0 if the tool cannot pass at all.
    """

    def __init__(
        self, message: str, segment: int, joint: str, position: float, largest_speed: float = 0.0
    ) -> None:
        self.segment, self.joint = segment, joint
        self.position, self.largest_speed = position, largest_speed
        super().__init__(message)


class ZoneError(InvalidArgumentError):
    """The arm would violate the clearance of a zone.

    Attributes:
        zone: Name of the zone, or ``"table"``, or a link of the arm itself.
        link: Name of the link that violates it.
        time: Time of the first violation, from the start of the motion [s].
        depth: Largest violation of the margin [m].
        margin: Required distance [m]; below zero where the link may touch the zone.
        what: The message without the remedy.
        remedy: What helps, in words.
    """

    def __init__(
        self,
        zone: str,
        link: str,
        time: float,
        depth: float,
        margin: float,
        detail: str,
        *,
        at_goal: bool = False,
    ) -> None:
        self.zone, self.link, self.time = zone, link, time
        self.depth, self.margin = depth, margin
        rule = (
            f"the margin of {margin * 1e3:.3g} mm is missed by {depth * 1e3:.1f} mm"
            if margin > 0.0
            else f"it may touch that, but this is {depth * 1e3:.1f} mm too deep"
        )
        itself = zone in ("base_link", "link_1")
        if at_goal:
            self.remedy = (
                "choose another goal" if itself else "choose another goal or correct the scene"
            )
        elif itself:
            self.remedy = "open the elbow first, by unfold(), or plan another way"
        else:
            self.remedy = "plan another way or correct the scene"
        self.what = f"{link} comes too near to {zone} {detail}; {rule}"
        super().__init__(self.what)

    @property
    def message(self) -> str:
        """The event and the remedy."""
        return f"{self.what}; {self.remedy}"


class GoalRejectedError(InvalidArgumentError):
    """A goal was refused before anything moved; the message names the violated rule."""


class ImageError(InvalidArgumentError):
    """A firmware image is damaged, or is not for this joint; nothing was written."""


class ConfigurationError(InvalidArgumentError):
    """A configuration value or file cannot be used."""


class CommunicationError(BioscaraError):
    """An exchange with a device failed.

    Attributes:
        address: 7-bit bus address of the device, or None if no single device is concerned.
    """

    code = -1

    def __init__(self, message: str, address: int | None = None) -> None:
        self.address = address
        super().__init__(message)


class NoAcknowledgeError(CommunicationError):
    """No device acknowledged the address or a byte (Linux reports errno 121, EREMOTEIO)."""


class BusTimeoutError(CommunicationError):
    """A transfer did not end within the adapter's timeout."""


class BusStuckError(CommunicationError):
    """A bus line is held low and recovery did not free it.

    Attributes:
        what: The observation.
        remedy: What to do; empty where only a layer above can say it.
        transactions: Number of transactions in a row that did not end; 0 if they were not counted.
        duration: Time since the first of them [s].
        reopened: How often re-opening the adapter did not help.
    """

    REMEDY = (
        "free the line: switch the joints off and on, or unplug them one by one to find the one "
        "that holds it low"
    )

    def __init__(
        self,
        message: str,
        address: int | None = None,
        remedy: str = "",
        transactions: int = 0,
        duration: float = 0.0,
        reopened: int = 0,
    ) -> None:
        self.what, self.remedy, self.reopened = message, remedy, reopened
        self.transactions, self.duration = transactions, duration
        super().__init__(message, address)

    @property
    def message(self) -> str:
        """The event and the remedy."""
        return f"{self.what}; {self.remedy}" if self.remedy else self.what


class CorruptFrameError(CommunicationError):
    """An answer failed its length, sequence or check byte."""


class RefusedError(CommunicationError):
    """The joint received the frame intact and refused to execute it.

    Attributes:
        reason: Name of the refusal reason, see :class:`bioscara.protocol.Refusal`.
        joint: Name of the joint.
    """

    code = -203

    def __init__(
        self, message: str, address: int | None = None, reason: str = "", joint: str = ""
    ) -> None:
        self.reason, self.joint = reason, joint
        super().__init__(message, address)


class JointLostError(CommunicationError):
    """A joint did not answer usefully for several control cycles, or tries, in a row.

    Attributes:
        joint: Name of the joint.
        bad_cycles: Number of consecutive failed cycles; 0 where the tries of one exchange failed.
        reason: Error of the last one.
    """

    def __init__(
        self,
        message: str,
        address: int | None = None,
        joint: str = "",
        bad_cycles: int = 0,
        reason: CommunicationError | None = None,
    ) -> None:
        self.joint, self.bad_cycles, self.reason = joint, bad_cycles, reason
        super().__init__(message, address)


class BusUnavailableError(CommunicationError):
    """The bus cannot be opened; the message names the remedy."""

    code = -2


class JointError(BioscaraError):
    """The state of a joint forbids the operation.

    Attributes:
        what: The event.
        joint: Name of the joint.
        remedy: The remedy when using this joint alone; the remedy for the whole arm differs.
    """

    code = -210

    def __init__(self, message: str, joint: str = "", remedy: str = "") -> None:
        self.what, self.joint, self.remedy = message, joint, remedy
        super().__init__(message)

    @property
    def message(self) -> str:
        """The event and the remedy."""
        return f"{self.what}; {self.remedy}" if self.remedy else self.what


class NotHomedError(JointError):
    """The joint does not know its position; home it first."""

    code = -2


class NotEnabledError(JointError):
    """The joint's motor is not engaged; enable it first."""

    code = -3


class StalledError(JointError):
    """The joint detected a stall and stopped; remove the obstacle, then ``clear_stall()``."""

    code = -4


class NotInitializedError(JointError):
    """The joint was not initialised, or it was already released."""

    code = -5


class IncorrectStateError(JointError):
    """A blocking command is running, or the running command is not the expected one."""

    code = -109


class _ToldFaultError(JointError):
    """A joint reports why it stopped.

    Attributes:
        fault: Name of the fault, see :class:`bioscara.protocol.Fault`; ``""`` if it reported none.
        data: The number that the joint stored with the fault; its meaning depends on the fault.
    """

    def __init__(
        self,
        message: str,
        joint: str = "",
        fault: str = "",
        data: float = 0.0,
        remedy: str = "",
    ) -> None:
        self.fault, self.data = fault, data
        super().__init__(message, joint, remedy)


class JointFaultError(_ToldFaultError):
    """A joint stopped autonomously and latched a fault."""

    code = -211


class HomingError(_ToldFaultError):
    """Homing ended without a trustworthy home; the joint is not homed."""

    code = -2


class FollowingError(JointError):
    """The following error of a joint exceeds its limit.

    Attributes:
        error: The following error [rad or m].
        limit: Largest following error allowed at its speed [rad or m].
    """

    code = -212

    def __init__(
        self, message: str, joint: str = "", error: float = 0.0, limit: float = 0.0
    ) -> None:
        self.error, self.limit = error, limit
        super().__init__(message, joint)


class JointResetError(JointError):
    """A joint restarted: its boot id changed, so its home and its session are lost.

    Attributes:
        reset_cause: Name of its reset cause, such as ``"WATCHDOG"``; empty if none was reported.
    """

    code = -213

    def __init__(
        self, message: str, joint: str = "", remedy: str = "", reset_cause: str = ""
    ) -> None:
        self.reset_cause = reset_cause
        super().__init__(message, joint, remedy)


class WrongJointError(JointError):
    """The device at an address is not the configured joint."""

    code = -214


class ReplayError(BioscaraError):
    """A replayed run sends other transactions to the bus than the recorded run.

    Attributes:
        record: Number of the record that differs, counted from 1.
    """

    code = -220

    def __init__(self, message: str, record: int) -> None:
        self.record = record
        super().__init__(message)


class NotSupportedError(BioscaraError):
    """The firmware of a joint cannot do this; the message names the firmware that can."""

    code = -221


class FlashError(BioscaraError):
    """A board or the program that flashes it cannot be used, or the flashing failed."""

    code = -222


class GripperError(BioscaraError):
    """The gripper or its PWM channel cannot be used."""

    code = -230


class MotionTimeoutError(BioscaraError):
    """A motion took longer than its caller allowed; the arm was brought to rest."""

    code = -272


class MotionCancelledError(BioscaraError):
    """A motion was cancelled; the arm ramped down."""

    code = -273


class JogExpiredError(MotionCancelledError):
    """A jog received no velocity for its expiry; it came to rest on its path and does not resume.

    Attributes:
        expiry: Longest time without a velocity [s].
    """

    def __init__(self, message: str, expiry: float) -> None:
        self.expiry = expiry
        super().__init__(message)


class BusyError(BioscaraError):
    """Another call is using the arm; nothing was done.

    Attributes:
        running: The call that uses it, for example ``"home()"``.
        duration: Time since that call began [s].
        thread: Name of the thread that called it.
    """

    code = -271

    def __init__(
        self, refused: str, running: str, duration: float, thread: str, inside: bool
    ) -> None:
        self.running, self.duration, self.thread = running, duration, thread
        super().__init__(
            f"{refused} refused inside {running}, which has been running for {duration:.1f} s: "
            f"call it when that has returned; stop() ends it"
            if inside
            else f"{refused} refused: {running} has been running for {duration:.1f} s in thread "
            f"{thread}; wait for its end, or end it with stop()"
        )


class HardwareError(BioscaraError):
    """A hardware component cannot perform the request.

    Attributes:
        component: Name of the component.
    """

    code = -240

    def __init__(self, message: str, component: str = "") -> None:
        self.component = component
        super().__init__(message)


class LifecycleError(HardwareError):
    """A lifecycle transition does not exist in the component's state, or it failed."""

    code = -241


class ModeSwitchError(HardwareError):
    """Joints cannot take the requested command modes; nothing was switched."""

    code = -242


class OverrunError(BioscaraError):
    """The control loop did not keep its deadlines."""

    code = -250


class RealtimeError(BioscaraError):
    """The system denies a loop real-time priority; the message names the remedy."""

    code = -251


class ControllerError(BioscaraError):
    """A controller raised, or produced an unusable command; it was switched off.

    Attributes:
        controller: Name of the controller.
    """

    code = -260

    def __init__(self, message: str, controller: str = "") -> None:
        self.controller = controller
        super().__init__(message)


class SwitchError(BioscaraError):
    """Controllers cannot be loaded, configured, switched or unloaded as requested."""

    code = -261


class GoalAbortedError(BioscaraError):
    """An accepted goal was aborted before completion.

    Attributes:
        result: Numeric result of control_msgs, for example -4 for a violated path tolerance.
    """

    code = -262

    def __init__(self, message: str, result: int = 0) -> None:
        self.result = result
        super().__init__(message)


class FaultedError(BioscaraError):
    """A fault is latched: acknowledge and recover it before the arm moves again."""

    code = -270


class UnconfirmedError(BioscaraError):
    """The surroundings are those of the owner's last run: a person has to look whether they hold.

    Attributes:
        what: The parts that are not confirmed, in words.
    """

    code = -274

    def __init__(self, message: str, what: str = "") -> None:
        self.what = what
        super().__init__(message)


class RecordingError(BioscaraError):
    """A recording cannot be written or read; the arm does not depend on it."""

    code = -290


class OwnerError(BioscaraError):
    """The process that owns an arm failed, or cannot be used."""

    code = -280


class OwnerLostError(OwnerError):
    """The owner of an arm does not run or does not answer; its joints stop autonomously."""

    code = -281


class BusyOwnerError(OwnerError):
    """Another owner has the arm, or the owner has too many requests; nothing was done."""

    code = -282


class LeaseError(OwnerError):
    """Another client commands the arm, or the lease of this one has lapsed; nothing was done.

    Attributes:
        holder: Name of the client that commands the arm; empty if none does.
    """

    code = -283

    def __init__(self, message: str, holder: str = "") -> None:
        self.holder = holder
        super().__init__(message)


class ConflictError(OwnerError):
    """Another client has changed a value since it was read; nothing was changed.

    Attributes:
        revision: Number that the value has now.
    """

    code = -284

    def __init__(self, message: str, revision: int = 0) -> None:
        self.revision = revision
        super().__init__(message)


class ProtocolError(OwnerError):
    """A message between a client and an owner cannot be understood."""

    code = -285


class AccessError(OwnerError):
    """This user or client may not do that."""

    code = -286


class EffortError(OwnerError):
    """A request takes more time or memory than one request may."""

    code = -287
