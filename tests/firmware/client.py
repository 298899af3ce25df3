"""Requests of a test to one joint, independent of the transport of its frames."""

from __future__ import annotations

from abc import ABC, abstractmethod

from bioscara.protocol import READ, WRITE, Answer, Fault, Flags, JointState, Message, Register


class Client(ABC):
    """Registers of one joint, written and read in frames of version 2."""

    @abstractmethod
    def send(self, message: Message, *values: float) -> Answer:
        """Exchange one frame."""

    def write(self, register: Register, *values: float) -> Answer:
        return self.send(WRITE[register], *values)

    def read(self, register: Register) -> tuple[float, ...]:
        return self.send(READ[register]).values

    def flags(self) -> Flags:
        return Flags(self.send(READ[Register.STATE]).flags)

    def state(self) -> JointState:
        return JointState(int(self.read(Register.STATE)[2]))

    def fault(self) -> Fault:
        return Fault(int(self.read(Register.FAULT)[0]))
