"""A homed arm under the control stack, on the compiled firmware, in virtual time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from bioscara.control.controllers.controller import AnyController
from bioscara.control.faults.flight_recorder import FlightRecord
from bioscara.control.faults.supervisor import Supervisor
from bioscara.control.limits.limiter import Limiter, joint_limiters
from bioscara.control.loop.loop import CycleReport, Loop
from bioscara.control.manager.manager import ControllerManager
from bioscara.hardware import ArmHardware
from bioscara.model import JointParameters
from bioscara.robot.connection.evidence_folder import EvidenceFolder
from simulated import ARM as PARAMETERS, NAMES, NEAR, simulated_bus

LIMITS = {joint.name: joint for joint in PARAMETERS.joints}
BOTH = ("position", "velocity")


class World:
    """An arm, its hardware component ACTIVE, a manager without controllers but the hold.

    Args:
        v1: Whether its joints speak version 1 only.
        controllers_fed: Whether its controllers stay on without the arm's supply.
        home: Whether the joints are homed and brought to ``at``.
        near: Where joints are when they are switched on [rad or m], instead of :data:`NEAR`.
        at: Where the joints are then [rad or m]; None leaves them near their end stops.
        folder: For evidence of faults.
        frequency: Of the bus [Hz]; None for a bus that takes no time.
        joints: Their parameters.
    """

    def __init__(
        self,
        *,
        v1: bool = False,
        controllers_fed: bool = False,
        home: bool = True,
        near: Mapping[str, float] | None = None,
        at: Mapping[str, float] | None = None,
        folder: Path = Path("/nonexistent"),
        frequency: float | None = 400e3,
        joints: Sequence[JointParameters] = PARAMETERS.joints,
    ) -> None:
        goal = at and [at.get(name, NEAR[name]) for name in NAMES]
        self.arm, self.bus = simulated_bus(
            v1=v1,
            controllers_fed=controllers_fed,
            positions=near,
            frequency=frequency,
            homed=home,
            at=goal,
        )
        self.clock = self.arm.clock
        self.rate = 50 if v1 else 100
        self.hardware = ArmHardware("bioscara_arm", self.bus, self.clock, joints)
        self.hardware.configure()
        self.hardware.activate()
        self.manager = ControllerManager(
            (self.hardware,), Limiter(joint_limiters((self.hardware,))), self.rate
        )
        self.record = FlightRecord(self.hardware.axes, self.rate)
        self.commanded = ("position",) if v1 else BOTH
        self.load(
            "hold",
            "bioscara_controllers/HoldController",
            joints=NAMES,
            command_interfaces=self.commanded,
            max_deceleration=tuple(joint.max_acceleration for joint in joints),
        )
        write = EvidenceFolder(folder).write
        self.supervisor = Supervisor(self.manager, self.hardware, "hold", self.record, write)
        self.loop = Loop(self.manager, self.supervisor, self.record, self.clock, self.rate)
        self.loop.step()

    def joint(self, name: str):  # type: ignore[no-untyped-def]
        """Return the driver of a joint."""
        return self.hardware.joints[NAMES.index(name)]

    def axis(self, name: str):  # type: ignore[no-untyped-def]
        """Return the axis of a joint."""
        return self.hardware.axes[NAMES.index(name)]

    def load(self, name: str, kind: str, **values: Any) -> AnyController:
        """Load and configure a controller."""
        self.manager.load(name, kind, values)
        self.manager.configure(name)
        return self.manager.controller(name)

    def switch(self, *activate: str, off: tuple[str, ...] = ()) -> None:
        """Switch controllers, strictly."""
        self.manager.switch(self.clock.now(), activate, off)

    def run(self, seconds: float) -> list[CycleReport]:
        """Run the loop for some arm time."""
        return [self.loop.step() for _ in range(round(seconds * self.rate))]

    def run_until(self, done: Callable[[], bool], seconds: float = 60.0) -> int:
        """Run the loop until ``done``; returns the number of cycles."""
        for cycle in range(round(seconds * self.rate)):
            if done():
                return cycle
            self.loop.step()
        raise AssertionError(f"not done within {seconds} s of arm time")

    def go(self, at: Mapping[str, float]) -> None:
        """Move the joints to positions [rad or m] while no controller is active."""
        forward = self.load(
            "go",
            "forward_command_controller/ForwardCommandController",
            joints=NAMES,
            interface_name="position",
        )
        self.switch("go")
        start = [axis.position.value for axis in self.hardware.axes]
        goal = [at.get(name, NEAR[name]) for name in NAMES]
        # As gently as planned motions: a jump of the goal would make the loads swing.
        seconds = max(
            0.3 + 1.6 * abs(b - a) / joint.max_velocity
            for a, b, joint in zip(start, goal, PARAMETERS.joints, strict=True)
        )
        cycles = round(seconds * self.rate)
        for cycle in range(1, cycles + 1):
            share = cycle / cycles
            share *= share * (3.0 - 2.0 * share)
            forward.command([a + share * (b - a) for a, b in zip(start, goal, strict=True)])
            self.loop.step()
        self.run_until(
            lambda: all(
                abs(axis.position.value - value) < 2e-3
                for axis, value in zip(self.hardware.axes, goal, strict=True)
            )
        )
        self.run(0.3)
        self.switch(off=("go",))
        self.manager.unload("go")
