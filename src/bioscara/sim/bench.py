"""The bench of a simulated arm: faults that a person switches on to see the reactions to them.

Each is applied to the arm or to its bus, ends after a time or can be switched off, and is listed
while it lasts, so that a client that connects later sees the cause in the arm.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

from bioscara.arguments import number, text
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


class BenchFault(NamedTuple):
    """A kind of fault, and the values that it takes.

    Attributes:
        of_joint: Whether it concerns one joint.
        meaning: What fails, in words.
        value: The meaning of the value, in words; empty if none has an effect.
        on: The value that begins it where none is given; NaN if one has to be given.
        off: The value that ends it; NaN if it ends after a time or by another one.
        lower: Smallest value.
        upper: Largest value.
        unit: Unit of the value; empty for switches and shares.
    """

    of_joint: bool
    meaning: str
    value: str = ""
    on: float = 1.0
    off: float = 0.0
    lower: float = 0.0
    upper: float = 1.0
    unit: str = ""


_SWITCH = "1 begins, 0 ends"
_POWER = "0 off, 1 on"

FAULTS = {
    "reset": BenchFault(True, "its controller restarts, and its home is lost", off=math.nan),
    "power": BenchFault(True, "its controller has no power", _POWER, 0.0, 1.0),
    "hang": BenchFault(True, "its firmware hangs; the watchdog of ours restarts it", _SWITCH),
    "overheat": BenchFault(True, "its motor driver is too hot", _SWITCH),
    "freeze_encoder": BenchFault(True, "its encoder reports an old angle", _SWITCH),
    "obstacle": BenchFault(
        True, "it runs into an obstacle", "position", math.nan, math.nan, -10.0, 10.0, "rad or m"
    ),
    "clear_obstacles": BenchFault(True, "its obstacles are away", off=math.nan),
    "push": BenchFault(
        True, "it is pushed", "torque or force (0 ends)", math.nan, 0.0, -1000.0, 1000.0, "N m or N"
    ),
    "supply": BenchFault(False, "the arm has no supply", _POWER, 0.0, 1.0),
    "brown_out": BenchFault(
        False, "the arm has no supply for a time", "time", math.nan, math.nan, 0.01, 10.0, "s"
    ),
    "bus_flips": BenchFault(
        False, "bits flip on the bus", "share of the bits (0 ends)", math.nan, upper=1e-2
    ),
    "bus_loss": BenchFault(
        False, "exchanges are lost on the bus", "share of the exchanges (0 ends)", math.nan
    ),
    "bus_stuck": BenchFault(False, "a line of the bus is held low", _SWITCH),
    "clear": BenchFault(False, "nothing fails any more", off=math.nan),
}
"""The faults, and the two that end others: ``clear_obstacles`` of a joint, and ``clear`` all."""


class Bench:
    """The faults of one simulated arm; used in the thread that runs its control loop.

    Attributes:
        faults: Those that last, oldest first; replaced as a whole, so that any thread may read it.
        changed: Called with a sentence after the time of a fault is over.
    """

    def __init__(self, arm: SimulatedArm, bus: FaultyBus) -> None:
        self._arm, self._bus = arm, bus
        self.faults: tuple[SimulatedFault, ...] = ()
        self.changed: Callable[[str], object] = lambda _: None
        self._on_bus: dict[str, list[Injection]] = {}
        self._due: dict[str, float] = {}

    def apply(self, fault: str, joint: str = "", value: float | None = None) -> str:
        """Let the arm fail, or end that.

        Args:
            fault: A key of :data:`FAULTS`.
            joint: The joint, for the faults of one.
            value: Whether it is on, 1 or 0; for ``power`` and ``supply`` whether that is on.
                Position of an obstacle [rad or m]; torque or force of a push [N m or N]; time
                without supply of a brown-out [s]; share of the flipped bits, or of the lost
                exchanges. None for the one that begins it, where it is a switch.

        Returns:
            A description of the change.

        Raises:
            InvalidArgumentError: There is no such fault or joint, or a value is missing.
            LimitError: The value is outside its range.
        """
        if (kind := FAULTS.get(text("fault", fault))) is None:
            hint = did_you_mean(fault, FAULTS, f"there are {', '.join(FAULTS)}")
            if fault == "motor_power":
                hint = (
                    "supply is that of the controllers, too; with controllers_fed=True of the "
                    "arm, it is that of the motors alone"
                )
            raise InvalidArgumentError(f"there is no simulated fault {fault!r}; {hint}")
        if not kind.of_joint:
            joint = ""
        elif text("joint", joint) not in JOINTS:
            what = f"there is no joint {joint!r}" if joint else f"{fault} is a fault of one joint"
            raise InvalidArgumentError(f"{what}; there are {', '.join(JOINTS)}")
        if value is None and math.isnan(kind.on):
            unit = f" [{kind.unit}]" if kind.unit else ""
            raise InvalidArgumentError(f"{fault} needs a value: {kind.value}{unit}")
        value = kind.on if value is None else number(f"value of {fault}", value)
        if not kind.lower <= value <= kind.upper:
            raise LimitError(f"value of {fault}", value, kind.lower, kind.upper, kind.unit)
        if fault == "clear":
            self._clear()
        else:
            self._set(fault, joint, value)
            self._list(SimulatedFault(fault, joint, value, self._arm.now()))
        return " ".join(word for word in (joint, fault, f"{value:g}" if kind.value else "") if word)

    def step(self, now: float) -> None:
        """End the faults whose time is over; called before each exchange on the bus.

        Args:
            now: Time on the arm's clock [s].
        """
        for name in [name for name, due in self._due.items() if due <= now]:
            del self._due[name]
            fault, _, joint = name.partition(" ")
            self._forget(fault, joint)
            self.changed(" ".join(word for word in (joint, fault, "is over") if word))

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
            case "supply":
                # It is on again after a brown-out, too.
                self._due.pop("brown_out", None)
                self._forget("brown_out", "")
                arm.set_supply(on)
            case "brown_out":
                if not any(each.fault == "supply" for each in self.faults):
                    arm.set_supply(False, value)
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
        # A joint that starts anew does not hang any more.
        if fault in {"reset", "power"}:
            self._forget("hang", joint)
        elif fault in {"supply", "brown_out"} and not self._arm.controllers_fed:
            for each in JOINTS:
                self._forget("hang", each)
        if fault == "hang" and joint not in self._arm.originals and new.value:
            self._due[f"hang {joint}"] = new.since + _WATCHDOG
        if fault != "reset" and new.value != FAULTS[fault].off:
            self.faults = (*self.faults, new)

    def _forget(self, fault: str, joint: str) -> None:
        self.faults = tuple(
            [each for each in self.faults if (each.fault, each.joint) != (fault, joint)]
        )

    def _clear(self) -> None:
        for fault, joint, *_ in self.faults:
            if fault == "obstacle":
                self._arm.clear_obstacles(joint)
            elif fault == "brown_out":
                self._arm.set_supply(True)
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
        world: The bodies around the arm, of a simulator above this one; None without.
    """

    def __init__(self, arm: SimulatedArm | None = None, seed: int = 0) -> None:
        super().__init__(arm)
        self._disturbed = FaultyBus(FirmwareBus(self.arm), seed, self.arm.clock)
        self.bench = Bench(self.arm, self._disturbed)
        self.world: object = None

    def transfer(self, transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
        """Carry out ``transactions`` in order, as far as the faults let them.

        Raises:
            BusUnavailableError: The bus is closed.
        """
        self.bench.step(self.arm.now())
        return self._disturbed.transfer(transactions)

    def close(self) -> None:
        """End the disturbances and refuse further transfers; the arm keeps running."""
        super().close()
        self._disturbed.close()
