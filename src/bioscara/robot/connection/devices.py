"""The devices of an arm: those on a named bus, or simulated ones."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from bioscara.arguments import flag, text
from bioscara.bus import Bus
from bioscara.bus.select import open_bus
from bioscara.clock import Clock, MonotonicClock
from bioscara.drivers import Gripper, Joint, Pwm
from bioscara.model import ArmParameters, GripperParameters
from bioscara.robot.connection.pacing import PacedClock

if TYPE_CHECKING:
    from bioscara.planning.world import World
    from bioscara.sim import SimulatedServo

WIDTH_FILE = Path("~/.local/state/bioscara/gripper-width")
"""File in which the last width of a real gripper is stored."""
_SERVED = "arm:NAME (one that 'bioscara serve' runs: 'bioscara arms' lists them)"


class Devices(NamedTuple):
    """The devices of an arm.

    Attributes:
        bus: The bus of the joints.
        clock: Clock of the arm.
        description: Which arm on which bus, in words.
        gripper: The driver of the gripper.
        servo: The simulated servo of that driver, which the robot must keep; else None.
    """

    bus: Bus
    clock: Clock
    description: str
    gripper: Gripper
    servo: object


def _firmware(v1: bool | Collection[str]) -> str:
    if not v1:
        return ""
    joints = "joints" if v1 is True else " and ".join(sorted(v1))
    return f", {joints} with their original firmware"


def simulated_devices(
    parameters: ArmParameters,
    *,
    v1: bool | Collection[str],
    seed: int,
    homed: bool = False,
    controllers_fed: bool = False,
    world: World | None = None,
) -> Devices:
    """Return the devices of an arm simulated in this process; arguments as ``Robot.simulated``."""
    # Imported here: the compiled firmware is a separate distribution.
    from bioscara.sim import BenchBus, FirmwareBus, SimulatedArm  # noqa: PLC0415

    arm = SimulatedArm(seed=seed, v1=v1, controllers_fed=controllers_fed)
    if flag("homed", homed):
        # As by a program before this one: the joints keep it until they are switched off.
        bus = FirmwareBus(arm)
        for each in parameters.joints:
            joint = Joint(bus, arm.clock, each)
            joint.init()
            joint.home()
            joint.disable()
    clock = PacedClock(arm.clock)
    gripper, servo = _simulated_gripper(parameters.gripper, clock)
    benched = BenchBus(arm, int(seed))
    if world is not None and world.has_bodies:
        # Imported here: the physics engine is an extra.
        from bioscara.physics.world import PhysicsWorld  # noqa: PLC0415

        benched.world = PhysicsWorld(arm, servo, world, parameters)
    description = f"simulation, in this process{_firmware(v1)}"
    return Devices(benched, clock, description, gripper, servo)


def devices_on(name: str, parameters: ArmParameters) -> Devices:
    """Return the devices of the arm on the bus of this name; nothing is opened yet.

    Raises:
        InvalidArgumentError: There is no bus of that name.
    """
    kind, _, where = text("the name of a bus", name).partition(":")
    if name == "sim":
        return simulated_devices(parameters, v1=False, seed=0)
    if kind == "sim" and where:
        from bioscara.sim import SocketBus, pwm_folder  # noqa: PLC0415

        served, jaws = SocketBus(Path(where)), parameters.gripper
        pwm = Pwm(jaws.outputs, served.clock, pwm_folder(where))
        gripper = Gripper(pwm, jaws, pwm_folder(where) / "width")
        description = f"simulation, in the process behind {where}"
        return Devices(served, served.clock, description, gripper, None)
    clock = MonotonicClock()
    bus = open_bus(name, ("sim", "sim:/path.sock", _SERVED))
    return Devices(bus, clock, f"real arm on {name}", real_gripper(parameters, clock), None)


def real_gripper(parameters: ArmParameters, clock: Clock) -> Gripper:
    """Return the gripper on the computer's own PWM output; nothing is opened yet."""
    jaws = parameters.gripper
    return Gripper(Pwm(jaws.outputs, clock), jaws, WIDTH_FILE.expanduser())


def _simulated_gripper(jaws: GripperParameters, clock: Clock) -> tuple[Gripper, SimulatedServo]:
    """Return the driver of a simulated gripper and its servo."""
    from bioscara.sim import SimulatedServo  # noqa: PLC0415

    servo = SimulatedServo(jaws.outputs[0])
    return Gripper(Pwm(jaws.outputs, clock, servo.root), jaws, servo.root / "width"), servo
