"""A simulated arm whose bus can be held, and threads that use it: for tests of several at once."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from pathlib import Path

from bioscara import Robot
from bioscara.bus import Transaction
from bioscara.drivers import Gripper, Pwm
from bioscara.errors import CommunicationError
from bioscara.report import CycleRecord
from bioscara.sim import FirmwareBus, SimulatedArm, SimulatedServo
from simulated import ARM, NAMES

START = (-2.0, 0.30, 2.0, 2.0)
GOAL = (-1.0, 0.28, 1.0, 1.0)
LONG = 30.0
"""Timeout that no operation reaches [s]: it only ends a test that would hang."""


class Gate:
    """A place where one thread waits until it is released."""

    def __init__(self) -> None:
        self._reached, self._open = threading.Event(), threading.Event()

    def wait(self) -> None:
        self._reached.set()
        assert self._open.wait(LONG)

    def reached(self) -> None:
        assert self._reached.wait(LONG)

    def open(self) -> None:
        self._open.set()


class WatchedBus(FirmwareBus):
    """Records which threads use it; the next transfer of a thread can be held."""

    def __init__(self, arm: SimulatedArm) -> None:
        super().__init__(arm)
        self.users: list[str] = []
        self.overlaps = self._inside = 0
        self.gates: dict[str, Gate] = {}
        self.ctrl_c: set[int] = set()
        self.closed = False

    def transfer(self, transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
        name = threading.current_thread().name
        self.users.append(name)
        self._inside += 1
        self.overlaps += self._inside > 1
        try:
            gate = self.gates.pop(name, None)
            if gate is not None:
                gate.wait()
            if len(self.users) in self.ctrl_c:
                raise KeyboardInterrupt
            return super().transfer(transactions)
        finally:
            self._inside -= 1

    def close(self) -> None:
        self.closed = True
        super().close()


class Other:
    """A thread that runs one call; at the end of the block it has ended."""

    def __init__(self, task: Callable[[], object], name: str = "other") -> None:
        self.error: BaseException | None = None
        self._task = task
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        try:
            self._task()
        except BaseException as error:  # noqa: BLE001  handed to the waiting caller
            self.error = error

    def ends_within(self, time: float) -> bool:
        self._thread.join(time)
        return not self._thread.is_alive()

    def end(self) -> BaseException | None:
        assert self.ends_within(LONG), "it hangs"
        return self.error


class Bench:
    """A robot on an arm, its bus and its servo."""

    def __init__(self, arm: SimulatedArm, evidence: Path) -> None:
        self.arm, self.bus, self.folder = arm, WatchedBus(arm), evidence
        self.servo = SimulatedServo(ARM.gripper.outputs[0])
        jaws = Gripper(
            Pwm(ARM.gripper.outputs, arm.clock, self.servo.root), ARM.gripper, evidence / "width"
        )
        self.robot = Robot(
            self.bus, arm.clock, ARM, "turn", gripper=jaws, servo=self.servo, evidence=evidence
        )

    def where(self) -> list[float]:
        return [self.arm.position(name) for name in NAMES]

    def speed(self) -> float:
        return max(abs(self.arm.velocity(name)) for name in NAMES)

    def pass_time(self) -> None:
        """Let so much time pass that the position of the arm is known only after a new read."""
        self.arm.run(1.0)

    def held_motion(self, cycle: int = 30) -> tuple[Other, Gate, list[CycleRecord]]:
        """Return a thread that moves the arm and is held in that cycle, and its records."""
        gate, records = Gate(), list[CycleRecord]()

        def observe(record: CycleRecord) -> None:
            records.append(record)
            if len(records) == cycle:
                gate.wait()

        mover = Other(lambda: self.robot.move_joints(GOAL, on_cycle=observe))
        gate.reached()
        return mover, gate, records

    def held_transfer(self, task: Callable[[], object]) -> tuple[Other, Gate]:
        """Return a thread that is held in its first transfer."""
        gate = self.bus.gates["other"] = Gate()
        self.pass_time()
        other = Other(task)
        gate.reached()
        return other, gate
