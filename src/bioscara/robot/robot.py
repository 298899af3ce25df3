"""The arm as one object: bus, joints and clock, wired."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

from bioscara.bus import Bus
from bioscara.bus.select import open_bus
from bioscara.clock import Clock, MonotonicClock
from bioscara.drivers import Joint, read_states
from bioscara.errors import BioscaraError, CommunicationError, JointError, NotHomedError
from bioscara.hardware.stopping import stop_and_disable
from bioscara.model import ArmParameters, load_parameters
from bioscara.planning import Trajectory, ramp, stop_ramp
from bioscara.protocol import Flags
from bioscara.report import CycleRecord, Phase
from bioscara.robot.homing import home_in_order
from bioscara.robot.pacing import PacedClock
from bioscara.robot.records import Cancelled, Observe, Recorder
from bioscara.robot.streaming import Streamer
from bioscara.robot.timeline import Reference, Segment, Timeline, hold

SETTLING = 0.3
"""How long the end of a trajectory is held, so that the arm is seen to rest there [s]."""
_PERIOD_V1, _PERIOD_V2 = 0.02, 0.01
"""Time between setpoints [s]: as the original driver, and as fits the bus at 100 kHz."""


def _ignore(record: CycleRecord) -> None:
    pass


def _never() -> bool:
    return False


class Robot:
    """A Bioscara arm.

    Used as a context manager: entering opens the bus and greets the joints, and nothing moves;
    leaving stops and disables them all, whatever happened.

    Args:
        bus: What the joints are on; closed in the end.
        clock: The arm's time.
        parameters: The arm as data.
        description: Which arm on which bus, in words.
        pace_homing: Whether simulated homing is held back to real time.
        pace_motion: Whether a simulated trajectory is held back to real time.

    Attributes:
        bus: What the joints are on.
        joints: The joints.
        clock: The arm's time.
        parameters: The arm as data.
        description: Which arm on which bus, in words.
    """

    def __init__(
        self,
        bus: Bus,
        clock: Clock,
        parameters: ArmParameters,
        description: str,
        *,
        pace_homing: bool = False,
        pace_motion: bool = False,
    ) -> None:
        self.parameters, self.clock, self.description = parameters, clock, description
        self.joints = tuple(Joint(bus, clock, joint) for joint in parameters.joints)
        self.bus = bus
        self._pace_homing, self._pace_motion = pace_homing, pace_motion
        self._names = tuple(joint.name for joint in parameters.joints)
        self._limits = parameters.joints
        self._active = False
        self._begin = clock.now()

    @classmethod
    def simulated(
        cls,
        parameters: ArmParameters | None = None,
        *,
        v1: bool = False,
        seed: int = 0,
        pace_homing: bool = False,
        pace_motion: bool = False,
    ) -> Self:
        """Return an arm that is simulated in this process: its firmware, its physics, its time.

        Args:
            parameters: The arm as data; the committed ones by default.
            v1: Whether its joints speak protocol version 1 only, as existing arms do.
            seed: Seed of everything random in it.
            pace_homing: Whether homing takes as long as on the arm.
            pace_motion: Whether a trajectory takes as long as on the arm.
        """
        # Here and not above: the compiled firmware is a distribution of its own.
        from bioscara.sim import FirmwareBus, SimulatedArm  # noqa: PLC0415

        parameters = parameters or load_parameters()
        arm = SimulatedArm(seed=seed, v1=v1)
        return cls(
            FirmwareBus(arm),
            PacedClock(arm.clock),
            parameters,
            "simulation, in this process" + (", joints of protocol version 1" if v1 else ""),
            pace_homing=pace_homing,
            pace_motion=pace_motion,
        )

    @classmethod
    def connect(cls, name: str, parameters: ArmParameters | None = None) -> Self:
        """Return the arm on the bus of this name.

        Args:
            name: ``linux:1``, ``linux:/dev/i2c-1``, or ``sim:/path.sock`` for an arm that
                ``bioscara simulate`` runs.
            parameters: The arm as data; the committed ones by default.

        Raises:
            InvalidArgumentError: No bus has such a name.
        """
        kind, _, where = name.partition(":")
        if kind == "sim" and where:
            from bioscara.sim import SocketBus  # noqa: PLC0415

            bus: Bus = SocketBus(Path(where))
            description = f"simulation, in the process behind {where}"
        else:
            bus = open_bus(name, ("sim", "sim:/path.sock"))
            description = f"real arm on {name}"
        return cls(bus, MonotonicClock(), parameters or load_parameters(), description)

    def __enter__(self) -> Self:
        try:
            for joint in self.joints:
                joint.init()
        except BaseException:
            self.bus.close()
            raise
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        try:
            self.shutdown()
        finally:
            self.bus.close()

    def home(self, observe: Observe = _ignore, cancelled: Cancelled = _never) -> None:
        """Home the joints that are not homed, in the order of the parameters.

        Args:
            observe: Takes a record of all joints at each look at them.
            cancelled: Asked at each look; True ends the homing.

        Raises:
            MotionCancelledError: It was asked to end; call :meth:`shutdown`.
            HomingError: A joint found no home that can be trusted.
            BioscaraError: As the drivers.
        """
        self._active = True
        self._pace(self._pace_homing)
        recorder = Recorder(self.joints, self.clock, observe, self._begin)
        chosen = [self._joint(name) for name in self.parameters.homing_order]
        home_in_order([joint for joint in chosen if not joint.is_homed()], recorder, cancelled)

    def clear_faults(self) -> list[str]:
        """Acknowledge the faults that joints latched before; nothing moves.

        Returns:
            A sentence for each.
        """
        cleared = []
        for joint in self.joints:
            if joint.version == 2 and joint.get_flags() & Flags.FAULT:
                report = joint.get_fault()
                joint.clear_fault(report.fault)
                cleared.append(f"{joint.name}: cleared {report.fault} ({report.data:g}) of before")
        return cleared

    def follow(
        self, trajectory: Trajectory, observe: Observe = _ignore, cancelled: Cancelled = _never
    ) -> None:
        """Go to the start of the trajectory on a planned ramp, then follow it.

        The trajectory is taken as checked. If anything ends it early, all joints that can still
        be reached ramp down together within their acceleration limits before this raises.

        Args:
            trajectory: For some or all of the joints; the others hold.
            observe: Takes a record of all joints each cycle.
            cancelled: Asked each cycle; True ends the motion.

        Raises:
            MotionCancelledError: It was asked to end.
            NotHomedError: A joint does not know its position.
            BioscaraError: As the drivers.
        """
        self._active = True
        self._pace(self._pace_motion)
        for joint in self.joints:
            if not joint.is_enabled():
                joint.enable()
        recorder = Recorder(self.joints, self.clock, observe, self._begin)
        streamer = Streamer(self.joints, self.clock, self.period, recorder)
        try:
            streamer.run(self._timeline(trajectory), cancelled)
        except BaseException as error:
            self._ramp_down(streamer, error)
            raise

    def shutdown(self) -> list[str]:
        """Stop and disable all joints; does nothing when that is done already.

        Returns:
            A sentence for each joint that could not be stopped or disabled.
        """
        if not self._active:
            return []
        self._active = False
        return stop_and_disable(self.joints)

    @property
    def period(self) -> float:
        """Time between two setpoints [s]."""
        return _PERIOD_V2 if all(joint.version == 2 for joint in self.joints) else _PERIOD_V1

    def _joint(self, name: str) -> Joint:
        return next(joint for joint in self.joints if joint.name == name)

    def _pace(self, paced: bool) -> None:
        if isinstance(self.clock, PacedClock):
            self.clock.paced = paced

    def _timeline(self, trajectory: Trajectory) -> Timeline:
        """Return approach, trajectory and settling, beginning where the arm stands."""
        here = []
        for joint, sample in zip(self.joints, read_states(self.joints, retry=True), strict=True):
            if isinstance(sample, BioscaraError):
                raise sample
            if sample.position is None:
                raise NotHomedError(
                    f"{joint.name} is not homed: its position is unknown", joint.name
                )
            # At an end stop the encoder may read a hair beyond the limit; setpoints never are.
            limit = joint.parameters
            here.append(min(max(sample.position, limit.lower), limit.upper))
        follow = self._sampler(trajectory, here)
        begin, end = follow(0.0), follow(trajectory.duration)
        approach = ramp(self._names, here, begin.positions, self._limits)
        return Timeline(
            [
                Segment(Phase.APPROACH, approach.duration, self._sampler(approach, here)),
                Segment(Phase.TRAJECTORY, trajectory.duration, follow),
                hold(Phase.SETTLING, end.positions, SETTLING),
            ],
            zero=approach.duration,
        )

    def _ramp_down(self, streamer: Streamer, error: BaseException) -> None:
        """Bring all joints that can be reached to rest together; raise nothing of the bus."""
        if isinstance(error, CommunicationError | JointError) and not streamer.leave_out(error):
            return
        while streamer.last is not None:
            reference = streamer.last
            rest = stop_ramp(self._names, reference.positions, reference.velocities, self._limits)
            sample = self._sampler(rest, reference.positions)
            segments = [
                Segment(Phase.STOPPING, rest.duration, sample),
                hold(Phase.STOPPING, sample(rest.duration).positions, self.period),
            ]
            try:
                streamer.run(Timeline(segments, zero=-streamer.last_time), _never)
            except BioscaraError as another:
                if streamer.leave_out(another):
                    continue
            return

    def _sampler(
        self, trajectory: Trajectory, elsewhere: Sequence[float]
    ) -> Callable[[float], Reference]:
        """Return the trajectory for all joints; those that it does not name rest ``elsewhere``."""
        columns = [
            trajectory.joint_names.index(name) if name in trajectory.joint_names else None
            for name in self._names
        ]
        resting = tuple(elsewhere)

        def sample(time: float) -> Reference:
            state = trajectory.sample(time)
            return Reference(
                tuple(
                    resting[index] if column is None else state.positions[column]
                    for index, column in enumerate(columns)
                ),
                tuple(0.0 if column is None else state.velocities[column] for column in columns),
            )

        return sample
