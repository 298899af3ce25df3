"""An arm of this process."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

from bioscara.arguments import flag, number, shown
from bioscara.bus import Bus
from bioscara.clock import Clock
from bioscara.control.controllers.joint_state_broadcaster import JointStates
from bioscara.control.faults.kinds import ArmFault
from bioscara.control.faults.warning import ArmWarning
from bioscara.drivers import Gripper, Joint
from bioscara.errors import InvalidArgumentError, MotionCancelledError
from bioscara.hardware import LifecycleState
from bioscara.kinematics import Joints, Pose
from bioscara.kinematics.pose import wrapped
from bioscara.model import ArmParameters, load_parameters, own_parameters
from bioscara.planning.collision.scene import Scene
from bioscara.planning.motions.jog_limitation import JogLimitation
from bioscara.robot import tasks
from bioscara.robot.arm import Arm
from bioscara.robot.arm_methods import ArmMethods, Glance, condition
from bioscara.robot.call_log import called, flush, log, logged, refused
from bioscara.robot.connection import exit_guard
from bioscara.robot.connection.arm_session import FAULTS, ArmSession
from bioscara.robot.connection.devices import devices_on, real_gripper, simulated_devices
from bioscara.robot.openers import OPENERS, ConnectOptions
from bioscara.robot.operations.change_workspace import ChangeWorkspace
from bioscara.robot.operations.motions.follow_trajectory import FollowTrajectory, checked
from bioscara.robot.operations.motions.jog import Jog, Velocity
from bioscara.robot.operations.operation import OnCycle, Operation
from bioscara.robot.robot_gripper import RobotGripper
from bioscara.robot.runner import Runner
from bioscara.robot.simulated_faults import simulate_fault
from bioscara.robot.stops import Stops
from bioscara.robot.tasks.task import Conditions, require_task
from bioscara.robot.workspace.poses import TeachTable
from bioscara.robot.workspace.workspace import Workspace

if TYPE_CHECKING:
    from bioscara.planning.world import World
    from bioscara.robot.simulation import Simulation


class Robot(ArmMethods):
    """A Bioscara arm of this process, and every other one by :meth:`connect`.

    :meth:`open` opens the bus and connects to the joints, and nothing moves; :meth:`close` always
    stops and disables all joints. A ``with`` statement does both; joints that could not be disabled
    are then reported by a HardwareError, or by notes on the exception that is being raised.
    SIGTERM, SIGHUP and the end of the program release the joints too, unless the program handles
    these signals itself.

    Created by :meth:`simulated` or :meth:`connect`.

    Args:
        bus: The bus of the joints; closed on leaving.
        clock: Clock of the arm.
        parameters: Parameters of the arm.
        description: Which arm on which bus, in words.
        gripper: The driver of the gripper; None for the computer's own PWM output.
        servo: The simulated servo of that driver; referenced for the lifetime of the robot.
        rate: Control cycles per second [Hz]; None for the rate that suits the joints.
        evidence: Folder for the flight records of faults.
        reduced_speed: Whether the tool keeps to 250 mm/s, even if more is commanded.
        pace_homing: Whether simulated homing is held back to real time.
        pace_motion: Whether simulated motion is held back to real time.
        scene: Surroundings to keep clear of; none if None.

    Attributes:
        bus: The bus of the joints.
        clock: Clock of the arm.
    """

    _own: ClassVar[frozenset[str]] = frozenset({"bus", "clock", "gripper"})

    def __init__(
        self,
        bus: Bus,
        clock: Clock,
        parameters: ArmParameters,
        description: str,
        *,
        gripper: Gripper | None = None,
        servo: object = None,
        rate: int | None = None,
        evidence: Path | str = FAULTS,
        reduced_speed: bool = True,
        pace_homing: bool = False,
        pace_motion: bool = False,
        scene: Scene | None = None,
    ) -> None:
        parameters = _require_parameters(parameters)
        self.bus, self.clock = bus, clock
        self._parameters, self._description = parameters, description
        driver = gripper or real_gripper(parameters, clock)
        self._servo = servo
        session = ArmSession(bus, clock, parameters, driver, rate=rate, evidence=evidence)
        workspace = Workspace.of(parameters, reduced_speed=reduced_speed)
        if scene is not None:
            workspace = workspace.with_scene(scene)
        self._arm = Arm(session, workspace, pace_homing=pace_homing, pace_motion=pace_motion)
        self._runner = Runner(self._arm)
        self.gripper = RobotGripper(self.do, self._jaws)

    @classmethod
    def simulated(
        cls,
        parameters: ArmParameters | None = None,
        *,
        v1: bool | Collection[str] = False,
        seed: int = 0,
        homed: bool = False,
        controllers_fed: bool = False,
        world: World | Path | str | None = None,
        rate: int | None = None,
        evidence: Path | str = FAULTS,
        reduced_speed: bool = True,
        pace_homing: bool = False,
        pace_motion: bool = False,
    ) -> Self:
        """Return an arm that is simulated in this process: firmware, physics and clock.

        Args:
            parameters: Parameters of the arm; the committed ones by default.
            v1: Whether its joints have their original firmware, as on existing arms; or the names
                of the joints that have it.
            seed: Seed of all random values in the simulation.
            homed: Whether an earlier program homed and released the joints, which stand where
                homing ends; they were just switched on otherwise.
            controllers_fed: Whether the joints' controllers get 5 V from elsewhere and stay on
                without the supply of the arm, as on no existing arm.
            world: Table, walls, nests and labware around the arm, or the file that has them: the
                gripper grips and drops, a collision stops the arm, and plans keep clear of
                them. Needs the physics engine of ``bioscara[physics]``.
            rate: Control cycles per second [Hz]; None for the rate that suits the joints.
            evidence: Folder for the flight records of faults.
            reduced_speed: Whether the tool keeps to 250 mm/s.
            pace_homing: Whether homing takes as long as on the arm.
            pace_motion: Whether motion takes as long as on the arm.

        Raises:
            ConfigurationError: The world cannot be used; the message names file and line.
            NotSupportedError: There is a world, and the physics engine is not installed.
        """
        parameters = load_parameters() if parameters is None else _require_parameters(parameters)
        around = _world_from(world)
        devices = simulated_devices(
            parameters, v1=v1, seed=seed, homed=homed, controllers_fed=controllers_fed, world=around
        )
        return cls(
            **devices._asdict(),
            parameters=parameters,
            scene=None if around is None else around.planned,
            rate=rate,
            evidence=evidence,
            reduced_speed=reduced_speed,
            pace_homing=pace_homing,
            pace_motion=pace_motion,
        )

    @classmethod
    def connect(
        cls,
        name: str,
        parameters: ArmParameters | None = None,
        *,
        rate: int | None = None,
        evidence: Path | str = FAULTS,
        reduced_speed: bool = True,
        timeout: float = 0.0,
        token: str | None = None,
        ca_file: Path | str | None = None,
        fingerprint: str | None = None,
    ) -> ArmMethods:
        """Return the arm on the bus of this name, or the one that another process owns.

        Args:
            name: ``linux:1``, ``linux:/dev/i2c-1``, ``sim`` for :meth:`simulated`, or
                ``sim:/path.sock`` for an arm that ``bioscara simulate`` runs; or ``arm:NAME`` for
                one that ``bioscara serve`` owns, or ``https://HOST:PORT``, the address of its
                gateway, which ``bioscara web`` runs. These are a ``bioscara.RemoteRobot``, and
                their owner decides what follows up to ``reduced_speed``.
            parameters: Parameters of the arm; by default the committed ones, with the overlay that
                the environment variable ``BIOSCARA_PARAMETERS`` names, if any.
            rate: Control cycles per second [Hz]; None for the rate that suits the joints.
            evidence: Folder for the flight records of faults.
            reduced_speed: Whether the tool keeps to 250 mm/s.
            timeout: Longest time for which :meth:`open` waits until the owner runs [s].
            token: Token of the gateway; None for that of the environment variable
                ``BIOSCARA_TOKEN``.
            ca_file: File with the certificates, as PEM, of the authorities that are trusted for the
                gateway; None for those of the system.
            fingerprint: SHA-256 fingerprint of the gateway's certificate, which is trusted in place
                of authorities, as ``bioscara web --tls-self-signed`` prints it.

        Raises:
            InvalidArgumentError: There is no bus of that name, an argument is the owner's, or one
                of a gateway cannot be used.
            ConfigurationError: The overlay or ``ca_file`` cannot be used.
            NotSupportedError: A package that a gateway needs is missing.
        """
        prefix = name.partition(":")[0] if isinstance(name, str) else ""
        access = ConnectOptions(timeout, token, ca_file, fingerprint)
        if (opener := OPENERS.get(prefix)) is not None:
            if (parameters, rate, evidence, reduced_speed) != (None, None, FAULTS, True):
                raise InvalidArgumentError(
                    f"{name}: its owner has the parameters, the rate, the folder of evidence and "
                    "the speed limit; leave them out, and set robot.reduced_speed when connected"
                )
            return opener(name, access)
        if prefix in {"arm", "http", "https"}:
            raise InvalidArgumentError(
                f"{name}: this Robot knows no owners; import it from bioscara: "
                "'from bioscara import Robot'"
            )
        if number("timeout", timeout, infinite=True) != 0.0:
            raise InvalidArgumentError(
                f"timeout {timeout!r} is for an owner, arm:NAME; a bus is there or is not"
            )
        if access.of_gateway:
            raise InvalidArgumentError(
                f"{access.of_gateway[0]} is for the address of a gateway, https://HOST:PORT; leave "
                "it out for a bus"
            )
        return cls.on_bus(
            name, parameters, rate=rate, evidence=evidence, reduced_speed=reduced_speed
        )

    @classmethod
    def on_bus(
        cls,
        name: str,
        parameters: ArmParameters | None = None,
        *,
        rate: int | None = None,
        evidence: Path | str = FAULTS,
        reduced_speed: bool = True,
    ) -> Self:
        """Return the arm on the bus of this name; arguments and errors as :meth:`connect`."""
        parameters = own_parameters() if parameters is None else _require_parameters(parameters)
        return cls(
            **devices_on(name, parameters)._asdict(),
            parameters=parameters,
            rate=rate,
            evidence=evidence,
            reduced_speed=reduced_speed,
        )

    def open(self) -> Self:
        exit_guard.guard(self, self.stop)
        try:
            self._runner.connect()
        except MotionCancelledError:
            # Stopped once connected.
            self.close()
            raise
        except BaseException as error:
            exit_guard.forget(self)
            refused("open()", error)
            raise
        log.info("connected: %s", self.description)
        return self

    def close(self) -> None:
        self._close(None)

    def _close(self, error: BaseException | None) -> None:
        was_open = self.is_open
        try:
            with exit_guard.postponed():
                self._runner.close(error)
        finally:
            if not self._arm.session.connected:
                exit_guard.forget(self)
        if was_open:
            flush()
            log.info("closed: %s", self.description)

    @property
    def is_open(self) -> bool:
        return self._arm.session.connected

    def shutdown(self) -> list[str]:
        return self._runner.shutdown()

    @property
    def runner(self) -> Runner:
        """Runs the operations of this robot, for programs that have their own ones."""
        return self._runner

    def watch(self, *, priority: int | None = None, real_time_factor: float = 1.0) -> None:
        self._runner.watch(priority=priority, real_time_factor=real_time_factor)

    def stop(self) -> None:
        self._arm.stop()

    def cancel(self) -> None:
        self._arm.stop()

    @property
    def _stops(self) -> Stops:
        return self._arm.stops

    def pause(self) -> None:
        self._arm.pause()

    def resume(self) -> None:
        self._arm.resume()

    def simulate_fault(self, fault: str, joint: str = "", value: float | None = None) -> None:
        simulate_fault(self._runner, fault, joint, value)

    @property
    def simulation(self) -> Simulation:
        # Imported here: it knows the physics engine.
        from bioscara.robot.simulation import Simulation  # noqa: PLC0415

        return Simulation(self)

    @property
    def parameters(self) -> ArmParameters:
        return self._parameters

    @property
    def description(self) -> str:
        return self._description

    @property
    def paused_by(self) -> tuple[str, ...]:
        return tuple(self._arm.pauses.values())

    @property
    def joints(self) -> tuple[Joint, ...]:
        """The drivers of the joints."""
        return self._arm.session.hardware.joints

    @property
    def firmware(self) -> tuple[str, ...]:
        return tuple(joint.firmware for joint in self.joints)

    @property
    def flags(self) -> tuple[int, ...]:
        return tuple(int(joint.session.flags) for joint in self.joints)

    @property
    def state(self) -> JointStates:
        return self._arm.states()

    @property
    def pose(self) -> Pose:
        positions = self._arm.positions("the pose of the tool is unknown")
        pose = self.kinematics.forward(positions)
        return pose._replace(yaw=wrapped(pose.yaw))

    @property
    def is_enabled(self) -> bool:
        session = self._arm.session
        return session.connected and session.hardware.state is LifecycleState.ACTIVE

    @property
    def is_moving(self) -> bool:
        return any(claim.devices for claim in self._arm.arbiter.running)

    @property
    def _held(self) -> bool:
        return self._arm.held

    @property
    def jog_limitation(self) -> JogLimitation | None:
        return self._runner.limitation

    @property
    def period(self) -> float:
        return self._arm.stack.loop.period

    @property
    def bus_share(self) -> float:
        return self._arm.stack.loop.bus_share

    @property
    def workspace(self) -> Workspace:
        return self._arm.workspace

    @property
    def faults(self) -> tuple[ArmFault, ...]:
        return tuple(self._arm.stack.supervisor.faults)

    @property
    def warnings(self) -> tuple[ArmWarning, ...]:
        return tuple(self._arm.stack.supervisor.warnings)

    @property
    def speed_override(self) -> float:
        return self._arm.speed_override

    @speed_override.setter
    def speed_override(self, share: float) -> None:
        self._arm.speed_override = share

    def _set_scene(self, scene: Scene) -> None:
        self._change("scene", lambda space: space.with_scene(scene))

    def _set_table(self, table: TeachTable) -> None:
        self._change("table", lambda space: space.with_table(table))

    def _change(self, what: str, change: Callable[[Workspace], Workspace]) -> None:
        operation = ChangeWorkspace(f"setting {what}", change)
        self._runner.execute(operation, self._admission(operation))

    def jog(
        self,
        velocities: Callable[[], Velocity | None],
        *,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> Operation[None]:
        return self._carry_out(Jog(velocities, timeout=timeout, on_cycle=on_cycle), wait)

    def _follow(
        self, trajectory: Any, conditions: Conditions, *, approach: bool, planned: bool, wait: bool
    ) -> Operation[None]:
        operation = FollowTrajectory(
            "execute()" if planned else "follow()",
            partial(checked, trajectory, planned=planned),
            approach=approach,
            **conditions._asdict(),
        )
        return self._carry_out(operation, wait)

    def do(
        self,
        task: tasks.ArmTask,
        *,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> Operation[Any]:
        require_task(task)
        return self._carry_out(task.operation(self._arm, Conditions(timeout, on_cycle)), wait)

    def _carry_out(self, operation: Operation[Any], wait: bool) -> Operation[Any]:
        in_loop, admit = self._arm.turn.mine, self._admission(operation)
        called(operation.name, in_loop=in_loop)
        with logged(operation, wait=flag("wait", wait), in_loop=in_loop):
            if wait:
                self._runner.execute(operation, admit)
            else:
                self._runner.start(operation, admit)
        return operation

    def _admission(self, operation: Operation[Any]) -> Callable[[], None]:
        """Return a function that raises if the call that begins an operation was stopped."""
        return partial(self._arm.stops.call().require, operation.name)

    def _positions(self, reason: str = "its position is unknown; home() first") -> Joints:
        return self._arm.positions(reason)

    def _jaws(self) -> tuple[float, tuple[float, float]]:
        return self._arm.jaws.commanded, self._arm.jaws.range()

    def _glance(self) -> Glance:
        session = self._arm.session
        if not session.connected:
            return Glance(self.description, "closed")
        states = session.stack.broadcaster.states
        pose = None
        if states is not None and not any(map(math.isnan, states.positions)):
            pose = self.kinematics.forward(states.positions)
        fault = self.faults[0] if self.faults else None
        calls = [claim.name for claim in self._arm.arbiter.running if claim.devices]
        told = condition(fault, calls, pose, enabled=self.is_enabled)
        return Glance(self.description, told, states, len(self.warnings))


def _world_from(world: World | Path | str | None) -> World | None:
    # Imported here: few arms have one.
    from bioscara.planning.world import World, read_world  # noqa: PLC0415

    if world is None or isinstance(world, World):
        return world
    if not isinstance(world, str | Path):
        raise InvalidArgumentError(f"the world is {shown(world)}; give a World, or its file")
    return read_world(world)


def _require_parameters(parameters: ArmParameters) -> ArmParameters:
    if not isinstance(parameters, ArmParameters):
        raise InvalidArgumentError(
            f"the parameters are {shown(parameters)}; give what load_parameters() returns"
        )
    return parameters
