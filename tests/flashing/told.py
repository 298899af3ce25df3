"""A bus on which joints report another image, exception or warning than the simulated ones do."""

from __future__ import annotations

import struct
from collections.abc import Sequence

from bioscara.bus import Bus, Transaction
from bioscara.errors import CommunicationError
from bioscara.protocol import READ, TRAILER, Register
from bioscara.protocol.crc import crc8


class Told(Bus):
    """Replaces the payload of answers; all else is the joint's own.

    Attributes:
        payloads: The answer of the joint at an address to a read of a register.
    """

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self.payloads: dict[tuple[int, Register], bytes] = {}

    def set_image(self, address: int, crc: int) -> None:
        """Let a joint run the image with this CRC-32."""
        self.payloads[address, Register.IMAGE] = struct.pack("<I", crc)

    def set_exception(self, address: int, *values: int) -> None:
        """Let a joint report this exception: vector, address, status, starts."""
        self.payloads[address, Register.EXCEPTION] = struct.pack("<BIIB", *values)

    def set_warnings(self, address: int, bits: int) -> None:
        """Let a joint report these warnings."""
        self.payloads[address, Register.WARNINGS] = bytes((bits,))

    def transfer(self, transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
        return [self._told(each, self._bus.transfer((each,))[0]) for each in transactions]

    def _told(
        self, asked: Transaction, answer: bytes | CommunicationError
    ) -> bytes | CommunicationError:
        known = asked.write[:1] and asked.write[0] in Register.__members__.values()
        payload = self.payloads.get((asked.address, Register(asked.write[0]))) if known else None
        if payload is None or isinstance(answer, CommunicationError):
            return answer
        message = READ[Register(asked.write[0])]
        if len(asked.write) != 1 + TRAILER or len(answer) != message.answer_size + TRAILER:
            return answer
        changed = payload + answer[len(payload) : -1]
        return changed + bytes((crc8((asked.address << 1 | 1, *changed)),))

    def close(self) -> None:
        self._bus.close()
