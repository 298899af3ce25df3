"""Capacity of a bus in control cycles per second."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from bioscara.clock import Clock
from bioscara.drivers import Joint, read_states
from bioscara.hardware.command_modes import Mode
from bioscara.protocol import READ, TRAILER, WRITE, Message, Register

_BUS_SHARE = 0.85
"""Share of a period that the bus may take: an occasional repetition must fit in."""
BUSY_SHARE = 0.8
"""Share of a period above which the bus leaves so little that a late loop says how much. Up to it
the repetition of one of four exchanges fits into the cycle that it was sent in."""
_NO_TIME = 1e-9
"""Stands for a time of zero [s]."""
_FIXED_BITS, _BITS_PER_BYTE = 30, 9
"""Two addresses with their acknowledge, the register and the conditions; each byte that follows."""
_TRIES = 3
"""Number of timings of the exchanges."""
_HELD = {WRITE[Register.MOVETOANGLE]: 350e-6, WRITE[Register.SETRPM]: 50e-6}
"""Time that a version 1 joint holds the clock low before answering [s]; measured on the arm."""
_READ = {
    1: (READ[Register.ANGLEMOVED], READ[Register.GETENCODERRPM]),
    2: (READ[Register.STATE],),
}
_TRACK = {
    1: (WRITE[Register.MOVETOANGLE], READ[Register.ANGLEMOVED]),
    2: (WRITE[Register.TRACK],),
}
_DRIVE = {version: (*read, WRITE[Register.SETRPM]) for version, read in _READ.items()}
_CYCLES = {Mode.POSITION: _TRACK, Mode.TRACK: _TRACK, Mode.VELOCITY: _DRIVE}
"""By mode and protocol: the messages of a cycle; in other modes a joint is read."""
_LOAD_BITS = _BITS_PER_BYTE * (
    WRITE[Register.TRACKLOAD].answer_size - WRITE[Register.TRACK].answer_size
)
"""By which an answer with the load is longer."""


def highest_rate(bus_time: float) -> int:
    """Return the highest rate [Hz] at which a cycle's exchanges leave a reserve on the bus.

    Args:
        bus_time: Their duration [s]; 0 for a bus that takes no time.
    """
    return int(_BUS_SHARE / max(bus_time, _NO_TIME))


class Capacity:
    """Bus time of the exchanges of a cycle.

    Times a read of the state of all joints and scales that time to other frames by their length.

    Attributes:
        rate: Cycles per second that the bus has to carry [Hz]; 0 while none has been chosen.
    """

    def __init__(self, joints: Sequence[Joint], clock: Clock) -> None:
        taken = []
        for _ in range(_TRIES):
            start = clock.now()
            read_states(joints)
            taken.append(clock.now() - start)
        # The shortest: delays by other work of the computer are not due to the bus.
        self._bit_time = min(taken) / sum(_bits(joint, Mode.NONE) for joint in joints)
        self.rate = 0

    def cycle_time(self, modes: Iterable[tuple[Joint, Mode]], loads: int = 0) -> float:
        """Return the bus time of a cycle [s].

        A joint that homes is counted as one that is read: its few extra bytes go in a separate
        call.

        Args:
            modes: All joints with their modes.
            loads: Number of joints that report their load with their answer to a setpoint.
        """
        bare = sum(
            self._bit_time * _bits(joint, mode) + _held(joint, mode) for joint, mode in modes
        )
        return bare + loads * self._bit_time * _LOAD_BITS

    def loads(self, modes: Sequence[tuple[Joint, Mode]]) -> int:
        """Return how many joints can report their load with their answer, in each cycle.

        As many as leave the bus below :data:`BUSY_SHARE`, or else one, if there is time at all. No
        rate and no mode is refused because of the loads.
        """
        able, cycles = len(load_reporters(modes)), max(self.rate, 1)
        bare, load = self.cycle_time(modes), max(self._bit_time * _LOAD_BITS, _NO_TIME)
        fitting = math.floor((BUSY_SHARE / cycles - bare) / load)
        return min(able, max(fitting, int(bare + load <= _BUS_SHARE / cycles)))


def load_reporters(modes: Iterable[tuple[Joint, Mode]]) -> list[Joint]:
    """Return the joints that can report their load with their answer to a setpoint."""
    return [
        joint for joint, mode in modes if _CYCLES.get(mode) is _TRACK and joint.session.reports_load
    ]


def _bits(joint: Joint, mode: Mode) -> int:
    trailer = TRAILER if joint.version == 2 else 0
    return sum(_size(message, trailer) for message in _messages(joint, mode))


def _held(joint: Joint, mode: Mode) -> float:
    if joint.version == 2:
        return 0.0
    return sum(_HELD.get(message, 0.0) for message in _messages(joint, mode))


def _messages(joint: Joint, mode: Mode) -> tuple[Message, ...]:
    return _CYCLES.get(mode, _READ)[joint.version]


def _size(message: Message, trailer: int) -> int:
    written, read = message.request_size - 1 + trailer, message.answer_size + trailer
    return _FIXED_BITS + _BITS_PER_BYTE * (written + read)
