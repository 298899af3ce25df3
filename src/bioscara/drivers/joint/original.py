"""What a joint with its original firmware needs from its host.

The firmware of the existing arms speaks protocol version 1. It takes some commands only when its
10 ms loop comes round, forgets them if another frame comes first, holds the clock of the whole bus
low when more is read than it wrote, and runs away when SETMAXVELOCITY reaches it in velocity mode.
Nothing on the wire tells it from newer firmware that speaks version 1, so every version 1 joint is
treated like this.
"""

from __future__ import annotations

import math
from weakref import WeakKeyDictionary

from bioscara.bus import Bus
from bioscara.protocol import WRITE, Flags, Message, Register

QUIET = 25e-3
"""Time without any frame after a command that the joint's loop takes [s]: its period of 10 ms plus
its work."""
BREAK_OFF = 0.6
"""Time after HOME before the next command that its loop takes [s]. The loop waits for half a second
before it moves and does not see STOP meanwhile; told to be busy again, it would go on homing in the
direction of before."""
START_UP = 1.0
"""Time without any frame after power-up [s]. The joint acknowledges its address during its set-up
of 0.6 s, but cannot answer yet."""

_DEFERRED = (WRITE[Register.HOME], WRITE[Register.CHECKORIENTATION], WRITE[Register.MOVESTEPS])
"""Commands that its loop takes. Others that it does not know go the same way; HELLO is the only
one that is ever sent to it (:mod:`bioscara.drivers.link.handshake`)."""
_TO_POSITION = (WRITE[Register.SETUP], WRITE[Register.MOVETOANGLE], WRITE[Register.MOVESTEPS])
_TO_VELOCITY = (WRITE[Register.SETRPM], WRITE[Register.STOP], WRITE[Register.HOME])
_MOVE, _HOME = WRITE[Register.MOVETOANGLE], WRITE[Register.HOME]
_STALL = int(Flags.STALL)

_REGISTER_PER_DEG = 200.0 / 360.0 * 256.0 * 0.0220
"""Units of the motor driver's acceleration register per deg/s^2 of the motor: 200 steps per turn,
and 5.632 units per step/s^2 as the firmware converts them."""
ACCELERATION_DEG = (1.001 / _REGISTER_PER_DEG, 65535.0 / _REGISTER_PER_DEG)
"""Accelerations of the motor that it takes as they are [deg/s^2]. Below, its register becomes 0 and
not even STOP has an effect; above, its 16 bits wrap to a small value. The lower one is a thousandth
above one unit, more than a float on the wire loses."""

_silent: WeakKeyDictionary[Bus, set[int]] = WeakKeyDictionary()
"""Addresses that did not acknowledge when they were last heard of, by bus."""


class Caution:
    """What must be remembered of one version 1 joint while its session is open.

    Attributes:
        alone_until: No frame before this time [s]; always past for version 2.
        broken_off_from: No other command that its loop takes before this time [s]; likewise.
        positioning: Whether the last command that counts put the joint into position mode.
        silent: Whether it did not acknowledge its address when it was asked last.
    """

    __slots__ = ("alone_until", "broken_off_from", "positioning", "silent")

    def __init__(self) -> None:
        self.alone_until = self.broken_off_from = -math.inf
        self.positioning = False
        self.silent = False

    def sending(self, message: Message) -> None:
        """Know that a frame is about to leave, whether or not it will arrive."""
        if message in _TO_VELOCITY:
            self.positioning = False

    def answered(self, message: Message, flags: int) -> None:
        """Know that a frame was executed; a stalled joint ignores MOVETOANGLE."""
        if message in _TO_POSITION and not (message is _MOVE and flags & _STALL):
            self.positioning = True

    def free_from(self, message: Message) -> float:
        """Return from when on a frame may be sent [s]."""
        if message in _DEFERRED:
            return max(self.alone_until, self.broken_off_from)
        return self.alone_until

    def sent(self, message: Message, time: float) -> None:
        """Know that a frame was, or may have been, received until ``time`` [s]."""
        if message in _DEFERRED:
            self.alone_until = time + QUIET
        if message is _HOME:
            self.broken_off_from = time + BREAK_OFF


def note_silence(bus: Bus, address: int) -> None:
    """Remember that nobody acknowledged: who answers there next may just have been switched on."""
    _silent.setdefault(bus, set()).add(address)


def was_silent(bus: Bus, address: int) -> bool:
    """Return whether nobody acknowledged there when it was last noted."""
    return address in _silent.get(bus, ())


def forget_silence(bus: Bus, address: int) -> None:
    """Know that the joint at ``address`` had its time after power-up."""
    _silent.get(bus, set()).discard(address)
