"""One joint of a simulated arm, addressed in bytes: the lowest interface there is."""

from __future__ import annotations

from bioscara.bus import Transaction
from bioscara.protocol import (
    READ,
    TRAILER,
    WRITE,
    Answer,
    Flags,
    Message,
    Register,
)
from bioscara.sim import FirmwareBus, SimulatedArm
from firmware.client import Client
from simulated import NEAR

HOME = {"j1": (0, 10, 30, 15), "j2": (0, 45, 50, 30), "j3": (1, 11, 25, 10), "j4": (1, 11, 30, 10)}
"""Direction of the motor, rpm, sensitivity, current: the arm's committed homing."""


class Host(Client):
    """Frames to one joint, each with the next sequence number."""

    def __init__(
        self, joint: str = "j4", arm: SimulatedArm | None = None, *, armed: bool = True
    ) -> None:
        self.arm = arm or SimulatedArm(positions={joint: NEAR[joint]})
        self.joint, self.address = joint, 0x10 + int(joint[1])
        self.bus = FirmwareBus(self.arm)
        self.sequence = 0
        if armed:
            self.arm_session()

    def arm_session(self, session: int = 1) -> None:
        hello = self.send(READ[Register.HELLO])
        self.send(WRITE[Register.ARM], hello.values[5], session)

    def raw(self, frame: bytes, read: int) -> bytes:
        (answer,) = self.bus.transfer([Transaction(self.address, frame, read)])
        assert isinstance(answer, bytes), answer
        return answer

    def bare(self, message: Message, *values: float) -> Answer:
        """Version 1."""
        return message.decode_v1(self.raw(message.encode_v1(values), message.answer_size))

    def frame(self, message: Message, *values: float) -> bytes:
        self.sequence = (self.sequence + 1) & 0xFF
        return message.encode_v2(self.address, self.sequence, values)

    def send(self, message: Message, *values: float) -> Answer:
        frame = self.frame(message, *values)
        answer = self.raw(frame, message.answer_size + TRAILER)
        return message.decode_v2(self.address, self.sequence, answer)

    def alive(self, seconds: float) -> None:
        """Let time pass while the watchdog is fed."""
        end = self.arm.now() + seconds
        while self.arm.now() < end:
            self.write(Register.WATCHDOG, 60)
            self.arm.run(0.02)

    def idle(self, limit: float = 60.0) -> Flags:
        """Feed the watchdog until the joint is not busy."""
        end = self.arm.now() + limit
        while self.arm.now() < end:
            self.alive(0.02)
            if not self.flags() & Flags.BUSY:
                break
        return self.flags()

    def enable(self, percent: int = 20) -> None:
        self.write(Register.SETUP, percent, percent)
        flags = self.idle()
        assert not flags & Flags.NOTENABLED

    def home(self) -> Flags:
        self.write(Register.HOME, *HOME[self.joint])
        return self.idle()

    def field(self) -> float:
        return self.arm.field(self.joint)

    def field_speed(self, span: float = 0.001) -> float:
        """Microsteps per second."""
        before = self.field()
        self.arm.run(span)
        return (self.field() - before) / span
