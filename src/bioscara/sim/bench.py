"""The bench of a simulated arm: faults that a person switches on to see what the software does.

Each is applied to the arm or to its bus, ends after a time or can be switched off, and is listed
while it lasts, so that a client that connects later sees the cause in the arm.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

from bioscara.arguments import number
from bioscara.bus import Direction, FaultyBus, Injection, Transaction, When
from bioscara.errors import CommunicationError, InvalidArgumentError, LimitError
from bioscara.sim.firmware_bus import FirmwareBus
from bioscara.sim.simulated_arm import JOINTS, SimulatedArm
from bioscara.spelling import did_you_mean

_WATCHDOG = 0.2
"""Time after which our firmware runs again that hung [s]: its watchdog of 100 ms has restarted it.
"""


class SimulatedFault(NamedTuple):
    """A fault that lasts.

    Attributes:
        fault: Its name, a key of :data:`FAULTS`.
        joint: The joint; empty if it concerns the whole arm.
        value: As it was given.
        since: When it began, on the arm's clock [s].
    """

    fault: str
    joint: str
    value: float
    since: float


class FaultRange(NamedTuple):
    """What a fault needs.

    Attributes:
        of_joint: Whether it concerns one joint.
        lower: Smallest value.
        upper: Largest value.
        unit: Unit of the value; empty for switches and shares.
        off: The value that ends it; NaN if it ends after a time or by another one.
    """

    of_joint: bool
    lower: float = 0.0
    upper: float = 1.0
    unit: str = ""
    off: float = 0.0


FAULTS = {
    "reset": FaultRange(True, off=math.nan),
    "power": FaultRange(True, off=1.0),
    "hang": FaultRange(True),
    "overheat": FaultRange(True),
    "freeze_encoder": FaultRange(True),
    "obstacle": FaultRange(True, -10.0, 10.0, "rad or m", math.nan),
    "clear_obstacles": FaultRange(True, off=math.nan),
    "push": FaultRange(True, -1000.0, 1000.0, "N m or N"),
    "motor_power": FaultRange(False, off=1.0),
    "brown_out": FaultRange(False, 0.01, 10.0, "s", math.nan),
    "bus_flips": FaultRange(False, 0.0, 1e-2),
    "bus_loss": FaultRange(False),
    "bus_stuck": FaultRange(False),
    "clear": FaultRange(False, off=math.nan),
}
"""The faults, and the two that end others: ``clear_obstacles`` of a joint, and ``clear`` all."""


class Bench:
    """The faults of one simulated arm; used in the thread that runs its control loop.

    Args:
        arm: The arm.
        bus: The bus in front of it.

    Attributes:
        faults: Those that last, oldest first; replaced as a whole, so that any thread may read it.
        changed: Called with a sentence after each change.
    """

    def __init__(self, arm: SimulatedArm, bus: FaultyBus) -> None:
        self._arm, self._bus = arm, bus
        self.faults: tuple[SimulatedFault, ...] = ()
        self.changed: Callable[[str], object] = lambda _: None
        self._on_bus: dict[str, list[Injection]] = {}
        self._due: dict[str, float] = {}

    def apply(self, fault: str, joint: str = "", value: float = 1.0) -> None:
        """Let the arm fail, or end that.

        Args:
            fault: A key of :data:`FAULTS`.
            joint: The joint, for the faults of one.
            value: Whether it is on, 1 or 0; for ``power`` and ``motor_power`` whether that is on.
                Position of an obstacle [rad or m]; torque or force of a push [N m or N]; time
                without motor supply of a brown-out [s]; share of the flipped bits, or of the lost
                exchanges.

        Raises:
            InvalidArgumentError: There is no such fault or joint.
            LimitError: The value is outside its range.
        """
        if (kind := FAULTS.get(fault)) is None:
            hint = did_you_mean(fault, FAULTS, f"there are {', '.join(FAULTS)}")
            raise InvalidArgumentError(f"there is no simulated fault {fault!r}; {hint}")
        if not kind.of_joint:
            joint = ""
        elif joint not in JOINTS:
            raise InvalidArgumentError(
                f"there is no joint {joint!r}; there are {', '.join(JOINTS)}"
            )
        value = number(f"value of {fault}", value)
        if not kind.lower <= value <= kind.upper:
            raise LimitError(f"value of {fault}", value, kind.lower, kind.upper, kind.unit)
        if fault == "clear":
            self._clear()
        else:
            self._set(fault, joint, value)
            self._list(SimulatedFault(fault, joint, value, self._arm.now()))
        self.changed(" ".join(word for word in ("simulated:", joint, fault, f"{value:g}") if word))

    def step(self, now: float) -> None:
        """End the faults whose time is over; called each cycle.

        Args:
            now: Time on the arm's clock [s].
        """
        for name in [name for name, due in self._due.items() if due <= now]:
            del self._due[name]
            fault, _, joint = name.partition(" ")
            if fault == "brown_out" and not self._lasts("motor_power"):
                self._arm.set_motor_power(True)
            self._forget(fault, joint)
            self.changed(" ".join(word for word in ("simulated:", joint, fault, "is over") if word))

    def _set(self, fault: str, joint: str, value: float) -> None:
        arm, on = self._arm, bool(value)
        match fault:
            case "reset":
                arm.reset(joint)
            case "power":
                arm.set_power(joint, on)
            case "hang":
                arm.hang(joint, on)
            case "overheat":
                arm.overheat(joint, on)
            case "freeze_encoder":
                arm.freeze_encoder(joint, on)
            case "obstacle":
                arm.add_obstacle(joint, value)
            case "clear_obstacles":
                arm.clear_obstacles(joint)
            case "push":
                arm.push(joint, value)
            case "motor_power":
                # It is on again after a brown-out, too.
                self._due.pop("brown_out", None)
                self._forget("brown_out", "")
                arm.set_motor_power(on)
            case "brown_out":
                arm.set_motor_power(False)
                self._due[fault] = arm.now() + value
            case _:
                self._disturb(fault, value)

    def _disturb(self, fault: str, value: float) -> None:
        """Disturb the bus, in place of how it was disturbed before."""
        for injection in self._on_bus.pop(fault, ()):
            injection.cancel()
        if not value:
            return
        bus = self._bus
        if fault == "bus_flips":
            made = [bus.noise(value)]
        elif fault == "bus_loss":
            # Half before and half after the joint has acted, together the share that is wanted.
            when = When(probability=1.0 - math.sqrt(1.0 - value))
            made = [bus.lose(direction, when) for direction in Direction]
        else:
            made = [bus.stuck()]
        self._on_bus[fault] = made

    def _list(self, new: SimulatedFault) -> None:
        """List a fault that lasts, or take it from the list."""
        fault, joint = new.fault, new.joint
        if fault == "clear_obstacles":
            self._forget("obstacle", joint)
            return
        if fault != "obstacle":
            self._forget(fault, joint)
        if fault in {"reset", "power"}:
            # A joint that starts anew does not hang any more.
            self._forget("hang", joint)
        if fault == "hang" and joint not in self._arm.originals and new.value:
            self._due[f"hang {joint}"] = new.since + _WATCHDOG
        if fault != "reset" and new.value != FAULTS[fault].off:
            self.faults = (*self.faults, new)

    def _forget(self, fault: str, joint: str) -> None:
        self.faults = tuple(
            [each for each in self.faults if (each.fault, each.joint) != (fault, joint)]
        )

    def _lasts(self, fault: str) -> bool:
        return any(each.fault == fault for each in self.faults)

    def _clear(self) -> None:
        for fault, joint, *_ in self.faults:
            if fault == "obstacle":
                self._arm.clear_obstacles(joint)
            elif fault == "brown_out":
                self._arm.set_motor_power(True)
            else:
                self._set(fault, joint, FAULTS[fault].off)
        self._due.clear()
        self.faults = ()


class BenchBus(FirmwareBus):
    """The bus to a simulated arm in this process whose faults a person can switch on.

    Args:
        arm: The arm; a new one with default settings if None.
        seed: Seed of the disturbances of the bus.

    Attributes:
        bench: The bench.
    """

    def __init__(self, arm: SimulatedArm | None = None, seed: int = 0) -> None:
        super().__init__(arm)
        self._disturbed = FaultyBus(FirmwareBus(self.arm), seed, self.arm.clock)
        self.bench = Bench(self.arm, self._disturbed)

    def transfer(self, transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
        """Carry out ``transactions`` in order, as far as the faults let them.

        Raises:
            BusUnavailableError: The bus is closed.
        """
        return self._disturbed.transfer(transactions)

    def close(self) -> None:
        """End the disturbances and refuse further transfers; the arm keeps running."""
        super().close()
        self._disturbed.close()
