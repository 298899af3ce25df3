"""Timing rules for joints with original firmware.

The firmware of the existing arms speaks protocol version 1. It takes some commands only when its
10 ms loop comes round, forgets them if another frame comes first, holds the clock of the whole bus
low when more is read than it wrote, and runs away when SETMAXVELOCITY reaches it in velocity mode.
STOP does not end its orientation check, whose wait for a target then goes on without stall
detection and deadman, until a later command crosses that target and the check turns the motor.
Nothing on the wire distinguishes it from newer firmware that speaks version 1, so these rules apply
to every version 1 joint.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from weakref import WeakKeyDictionary

from bioscara.bus import Bus
from bioscara.protocol import WRITE, Flags, Message, Register

QUIET = 25e-3
"""Pause without any frame after a command taken by the joint's loop [s]: the loop's period of 10 ms
plus its execution time."""
HOME_PAUSE = 0.6
"""Time after HOME before the next command taken by its loop, or MOVESTEPS [s]. The loop waits for
half a second before it moves and ignores STOP during that time; another blocking command would make
it resume homing in the previous direction, and it would end a move."""
CHECK_MOST = 5.0
"""Longest time for which a command waits for the end of an orientation check [s]. A check that has
not ended by then never does: STOP halts its motion, and the joint has to be switched off and on."""
START_UP = 1.0
"""Pause without any frame after power-up [s]. The joint acknowledges its address during its set-up
of 0.6 s, but cannot answer yet."""

_HOME, _CHECK = WRITE[Register.HOME], WRITE[Register.CHECKORIENTATION]
_DEFERRED = (_HOME, _CHECK)
"""Commands taken by its loop, as are all that it does not know; of those, only HELLO is ever sent
to it (:mod:`bioscara.drivers.link.handshake`)."""
_TO_POSITION = (WRITE[Register.SETUP], WRITE[Register.MOVETOANGLE], WRITE[Register.MOVESTEPS])
_TO_VELOCITY = (WRITE[Register.SETRPM], WRITE[Register.STOP], _HOME)
_AFTER_HOME = (*_DEFERRED, WRITE[Register.MOVESTEPS])
_MOVE, _STOP, _RPM = WRITE[Register.MOVETOANGLE], WRITE[Register.STOP], WRITE[Register.SETRPM]
_MOVING = (*_TO_POSITION, _RPM, *_DEFERRED)
"""Commands after which its ramp may run: also SETUP, which makes it return to its place from where
it is pushed."""
_STALL, _BUSY = int(Flags.STALL), int(Flags.BUSY)

_REGISTER_PER_DEG = 200.0 / 360.0 * 256.0 * 0.0220
"""Units of the motor driver's acceleration register per deg/s^2 of the motor: 200 steps per turn,
and 5.632 units per step/s^2 as the firmware converts them."""
ACCELERATION_DEG = (1.001 / _REGISTER_PER_DEG, 65535.0 / _REGISTER_PER_DEG)
"""Accelerations of the motor that it applies unchanged [deg/s^2]. Below, its register becomes 0 and
not even STOP has an effect; above, its 16 bits wrap to a small value. The lower one is a thousandth
above one unit, more than a float on the wire loses."""

_silent: WeakKeyDictionary[Bus, set[int]] = WeakKeyDictionary()
"""Addresses that did not acknowledge at their last check, by bus."""


class OriginalTiming:
    """Timing state of one version 1 joint while its session is open.

    Attributes:
        quiet_until: Send no frame before this time [s]; always in the past for version 2.
        deferred_from: Send no other command for its loop before this time [s]; likewise.
        check_until: Send no command before this time while it reports that it is busy [s]: it may
            be in an orientation check; likewise.
        in_position_mode: Whether the last mode-changing command put the joint into position mode.
        silent: Whether it did not acknowledge its address at the last request.
        stopped_at: When it took STOP [s]; infinite if it never did, or may have been moved since.
            Only the time since then shows that its ramp has ended: that of a motor that is held
            goes on, at a standstill of the encoder, and nothing on the wire reports it.
    """

    __slots__ = (
        "check_until", "deferred_from", "in_position_mode", "quiet_until", "silent", "stopped_at",
    )  # fmt: skip

    def __init__(self) -> None:
        self.quiet_until = self.deferred_from = self.check_until = -math.inf
        self.stopped_at = math.inf
        self.in_position_mode = False
        self.silent = False

    def sending(self, message: Message, values: Sequence[float]) -> None:
        """Record that a frame is about to be sent, whether or not it will arrive."""
        if message in _TO_VELOCITY:
            self.in_position_mode = False
        if message in _MOVING and not (message is _RPM and values[0] == 0.0):
            self.stopped_at = math.inf

    def answered(self, message: Message, flags: int, time: float) -> None:
        """Record that a frame was executed until ``time`` [s]; a stalled joint ignores MOVETOANGLE.

        The first STOP counts: a later one does not prolong the ramp.
        """
        if message in _TO_POSITION and not (message is _MOVE and flags & _STALL):
            self.in_position_mode = True
        elif message is _STOP:
            self.stopped_at = min(self.stopped_at, time)
        if message is not _CHECK and not flags & _BUSY:
            self.check_until = -math.inf

    def free_from(self, message: Message) -> float:
        """Return the earliest time at which a frame may be sent [s]."""
        if message in _AFTER_HOME:
            return max(self.quiet_until, self.deferred_from)
        return self.quiet_until

    def sent(self, message: Message, time: float) -> None:
        """Record that a frame was, or may have been, received until ``time`` [s]."""
        if message in _DEFERRED:
            self.quiet_until = time + QUIET
        if message is _HOME:
            self.deferred_from = time + HOME_PAUSE
        elif message is _CHECK:
            self.check_until = time + CHECK_MOST


def note_silence(bus: Bus, address: int) -> None:
    """Record a missing acknowledge: a joint answering there next may just have been powered up."""
    _silent.setdefault(bus, set()).add(address)


def was_silent(bus: Bus, address: int) -> bool:
    """Return whether an acknowledge was missing there at the last record."""
    return address in _silent.get(bus, ())


def forget_silence(bus: Bus, address: int) -> None:
    """Record that the joint at ``address`` had its pause after power-up."""
    _silent.get(bus, set()).discard(address)
