"""Every message between an owner and its clients, as structs.

A connection begins with :class:`ClientHello` and its answer :class:`Welcome`. Then the client sends
:class:`ClientRequest`, each answered by one :class:`Response` or :class:`RequestFailed` of the same
number, and the owner sends :class:`StateSample`, :class:`ControllersSample`, :class:`WorldSample`,
:class:`Event` and :class:`GoalCycle` to subscribers.

Lengths are in m, angles in rad, times in s. A number that is unknown is NaN, and null in JSON;
a speed without a limit is infinite, and null in JSON, where a client leaves it out. A pose is
``[x, y, z, yaw]``. Bytes are base64 in JSON.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated, Any, ClassVar, Literal

import msgspec

from bioscara.control.controllers.goal_handle import GoalStatus
from bioscara.control.controllers.gripper_messages import GripperGoal
from bioscara.control.controllers.joint_trajectory.goal_messages import Goal, JointTrajectory, Point
from bioscara.control.faults.kinds import FaultKind
from bioscara.control.faults.supervisor import FaultState
from bioscara.hardware.component import LifecycleState
from bioscara.kinematics import Pose
from bioscara.model import ArmParameters
from bioscara.physics.bodies import BodyPose, BodyShape
from bioscara.planning import Sample
from bioscara.planning.collision.arm_bodies import Body
from bioscara.planning.collision.scene import Box, Cylinder
from bioscara.planning.motions.jog_limitation import JogLimitation
from bioscara.report import CycleRecord
from bioscara.robot import tasks
from bioscara.robot.operations.running import Status
from bioscara.robot.tasks.checks import check_fields
from bioscara.robot.tasks.fields import OfJoints, OfTool
from bioscara.robot.tasks.scope import Scope
from bioscara.robot.tasks.task import Task
from bioscara.robot.tasks.workspace import WorkspaceChange
from bioscara.robot.workspace.load import Load
from bioscara.robot.workspace.poses import TeachTable
from bioscara.robot.workspace.tools import Tool

VERSION = 1
"""Version of the messages; owner and client of different ones do not understand each other."""
NAME_MAX = 64
"""Longest name of a client, and of a session [characters]."""

OnLeaseLoss = Literal["stop", "finish"]
"""Reaction of a goal when the lease of its client lapses."""
EventKind = Literal[
    "goal_accepted",
    "goal_ended",
    "fault",
    "acknowledged",
    "faults_cleared",
    "warning",
    "unconfirmed",
    "lease",
    "stop",
    "pause",
    "resume",
    "workspace",
    "parameters",
    "controllers",
    "gateway",
    "client",
    "speed_override",
    "simulation",
    "report",
    "owner",
    "gap",
]
"""What happened. ``acknowledged`` is a fault with its evidence; ``gap`` are events that are not
kept any more, in number up to its own."""


def _one_of(names: Iterable[str]) -> msgspec.Meta:
    """Return the metadata of a name: who uses it refuses others, with the names that there are."""
    return msgspec.Meta(extra_json_schema={"enum": list(names)})


FaultName = Annotated[str, _one_of(kind.name for kind in FaultKind)]
"""Name of a kind of fault."""
LifecycleName = Annotated[str, _one_of(state.label for state in LifecycleState)]
"""Name of the lifecycle state of a controller or hardware component."""
SIMULATED_FAULTS = (
    *("reset", "power", "hang", "overheat", "freeze_encoder", "obstacle", "clear_obstacles"),
    *("push", "supply", "brown_out", "bus_flips", "bus_loss", "bus_stuck", "clear"),
)
"""Names of the faults of a simulated arm, and of what ends them."""
SimulatedFaultName = Annotated[str, _one_of(SIMULATED_FAULTS)]
"""One of these."""


class ApiMessage(msgspec.Struct, frozen=True, tag_field="kind", tag=True):
    """Base of the messages: the field ``kind`` distinguishes them."""


class Value(msgspec.Struct, frozen=True):
    """Base of the values within messages."""


# Values.


class TrajectoryValue(Value, frozen=True):
    """A trajectory, as :class:`bioscara.Trajectory`.

    Attributes:
        joint_names: The joints.
        times: Time of each point [s].
        positions: For each point one for each joint.
        velocities: Likewise, or null.
        accelerations: Likewise, or null; need velocities.
    """

    joint_names: tuple[str, ...]
    times: tuple[float, ...]
    positions: tuple[tuple[float, ...], ...]
    velocities: tuple[tuple[float, ...], ...] | None = None
    accelerations: tuple[tuple[float, ...], ...] | None = None


class BoxZone(Value, frozen=True, tag_field="kind", tag="box"):
    """A zone that is a box.

    Attributes:
        zone: The box.
    """

    zone: Box


class CylinderZone(Value, frozen=True, tag_field="kind", tag="cylinder"):
    """A zone that is a cylinder.

    Attributes:
        zone: The cylinder.
    """

    zone: Cylinder


class SceneValue(Value, frozen=True):
    """The surroundings of the arm, as :class:`bioscara.Scene`.

    Attributes:
        zones: Spaces to keep in or out of.
        table_height: Height of the table's top, or null.
        margin: Distance to keep from everything.
        mounted: Bodies that the wrist carries; null for the gripper.
    """

    zones: tuple[BoxZone | CylinderZone, ...] = ()
    table_height: float | None = None
    margin: float = 5e-3
    mounted: tuple[Body, ...] | None = None


class FailureValue(Value, frozen=True):
    """An error, raised as the same class on the other side.

    Attributes:
        error: Name of its class.
        code: Its number, as docs/errors.md lists them.
        text: Its message.
        data: Its attributes.
    """

    error: str
    code: int
    text: str
    data: dict[str, Any] = {}


class FaultValue(Value, frozen=True):
    """A fault of the arm.

    Attributes:
        fault: Its kind, as ``STALL``.
        source: Joint, component or controller that it concerns.
        text: What happened, and the action required of a person.
        cause: The error behind it.
        time: When it was detected, on the arm's clock.
        evidence: Name of its flight record, once that is written; else null.
    """

    fault: FaultName
    source: str
    text: str
    cause: FailureValue
    time: float
    evidence: str | None = None


class JointCounters(Value, frozen=True):
    """Counters of a joint since its boot, and its latched fault.

    Attributes:
        fault: Name of its first fault since cleared, as ``STALL``; ``NONE`` without one.
        data: The number that it stored with the fault; docs/protocol.md has its meaning.
        refusal: Name of the reason of its last refusal; ``NONE`` without one.
        broken: Frames that arrived broken.
        refused: Frames that it refused.
        bus_errors: Errors of the bus that it met; null if its firmware does not count them.
    """

    fault: str
    data: float
    refusal: str
    broken: int
    refused: int
    bus_errors: int | None


class JointValue(Value, frozen=True, kw_only=True):
    """One joint, as it describes itself.

    Attributes:
        name: Its name.
        address: Its address on the bus.
        protocol: Version of the protocol that it speaks; 0 while it is not identified.
        firmware: Version of its firmware, as ``0.1``; empty for the original firmware.
        boot_id: A number that differs between boots; null if its firmware has none.
        reset_cause: Why its controller started, as ``power on``; empty if it does not report it.
        capabilities: Functions beyond those of the original firmware.
        mode: Command mode that it is in: ``none``, ``position``, ``velocity``, ``home`` or
            ``track``.
        halted: Why it takes no commands until a recovery; empty while it does.
        hot: Whether its motor driver switched off because of its temperature; null if unknown.
        retries: Exchanges that the host repeated since it began.
        counters: Its counters; null if its firmware counts nothing, or they were never read.
    """

    name: str
    address: int
    protocol: int
    firmware: str
    boot_id: int | None
    reset_cause: str
    capabilities: tuple[str, ...]
    mode: str
    halted: str
    hot: bool | None
    retries: int
    counters: JointCounters | None


class GripperValue(Value, frozen=True):
    """How a motion of the jaws ended, as control_msgs has it.

    Attributes:
        position: Width between the jaws.
        velocity: As measured.
        reached_goal: Whether the width is the goal's.
        stalled: Whether the jaws were held up.
        quality: Reliability: 0 fresh, 1 stale, 2 assumed, 3 unknown.
    """

    position: float
    velocity: float
    reached_goal: bool
    stalled: bool
    quality: int


class GoalValue(Value, frozen=True):
    """A goal: something that the arm does, did, or refused to do.

    Attributes:
        goal: Its number, counted from 1 since the owner began.
        name: Name of its task, as ``move_to()``.
        client: Name of its client.
        status: ``waiting``, ``running``, ``paused``, ``stopping``, ``succeeded``, ``cancelled`` or
            ``failed``.
        progress: Share that is done, 0 to 1; NaN if that is unknown.
        failure: Why it ended early; null otherwise.
        gripper: How the jaws ended, for their goals.
        duration: Planned duration of its trajectory; NaN without one.
        notes: Notes on its plan for the user.
        limitation: Why a jog does not fully follow its velocity, or did not at its end; else null.
    """

    goal: int
    name: str
    client: str
    status: Status
    progress: float
    failure: FailureValue | None = None
    gripper: GripperValue | None = None
    duration: float = float("nan")
    notes: tuple[str, ...] = ()
    limitation: JogLimitation | None = None

    @property
    def done(self) -> bool:
        """Whether it has ended."""
        return self.status in {Status.SUCCEEDED, Status.CANCELLED, Status.FAILED}


class LeaseValue(Value, frozen=True):
    """Holder of the right to command the arm.

    Attributes:
        client: Name of the holder; null if there is none.
        epoch: Number of the lease; every commanding request carries it.
        remaining: Time until it lapses unless it is renewed.
    """

    client: str | None
    epoch: int
    remaining: float


# Tasks that need the owner; the others are those of the arm itself, bioscara.robot.tasks.


class OwnerTask(Task, frozen=True):
    """Base of the tasks of a goal that only an owner can carry out."""

    scope = Scope.OPERATE


class Follow(OwnerTask, frozen=True, tag="follow"):
    """Follow a trajectory.

    Attributes:
        trajectory: The trajectory, or its last points if an upload has those before.
        approach: Whether to move to its start from anywhere.
        planned: Whether it was planned by this software: it is then smooth already.
        upload: Number of the upload with the points before; 0 if there is none.
    """

    trajectory: TrajectoryValue
    approach: bool = False
    planned: bool = False
    upload: int = 0


class Execute(OwnerTask, frozen=True, tag="execute"):
    """Execute a plan that was made before.

    Attributes:
        plan: Its number.
    """

    plan: int


class Jog(OwnerTask, frozen=True, tag="jog"):
    """Move by streamed velocities, until :class:`EndJog`.

    With an expiry the jog ends once no velocity has arrived for that time: the arm comes to rest on
    its path, the goal ends ``cancelled`` with a JogExpiredError, and velocities that come later are
    refused. The owner counts from the arrival of :class:`Start` and each :class:`SetJogVelocity`.
    Without one the arm rests after 0.15 s and moves on with the next velocity.

    Attributes:
        expiry: Longest time without a velocity, 0.05 to 0.5 s; null: the arm waits at rest.
        joints: First velocity of the joints, or null.
        tool: First velocity of the tool, or null; with an expiry one of the two is given.
    """

    expiry: float | None = None
    joints: OfJoints | None = None
    tool: OfTool | None = None


class SetScene(WorkspaceChange, frozen=True, kw_only=True, tag="set_scene"):
    """Replace the scene.

    Attributes:
        scene: The new one.
    """

    scene: SceneValue


class SetTable(WorkspaceChange, frozen=True, kw_only=True, tag="set_table"):
    """Replace the tools, poses and frames that have names.

    They are saved in the owner's file, and nothing changes if that cannot be written. Where another
    program has changed the file, the arm has the poses of the file from then on, and the goal
    fails with a ConflictError.

    Attributes:
        table: The new one.
        save: Whether it is saved; else it applies until the owner ends or another one is saved.
    """

    table: TeachTable
    save: bool = True


Motion = tasks.Motion
"""The motions that can be planned."""

AnyTask = tasks.ArmTask | Follow | Execute | Jog | SetScene | SetTable
"""What a goal can be."""


# Commands: the bodies of requests.


class Command(ApiMessage, frozen=True, forbid_unknown_fields=True):
    """Base of the commands.

    Attributes:
        scope: The right that a client needs.
        needs_lease: Whether the request has to carry the epoch of a lease.
        slow: Whether its answer takes longer than a control cycle, as it plans or reads a file: of
            those, a client has a limited number in work.
    """

    scope: ClassVar[Scope] = Scope.ADMIN
    needs_lease: ClassVar[bool] = False
    slow: ClassVar[bool] = False

    @property
    def required_scope(self) -> Scope:
        """The right that a client needs for this very command."""
        return self.scope


class Query(Command, frozen=True):
    """Base of the commands that are carried out again when they come again.

    They change nothing, or stop the arm.
    """

    scope = Scope.VIEW


class Start(Command, frozen=True, kw_only=True, tag="start"):
    """Begin a goal; answered by :class:`Accepted`. Its end is an event, and :class:`GetGoal`.

    Attributes:
        task: Its task.
        timeout: Longest duration; null for no limit.
        on_lease_loss: Whether it is stopped or finishes when the lease of its client lapses or is
            released; it is stopped when another client takes the lease.
        records: Whether the client gets a :class:`GoalCycle` at the end of each control cycle.
    """

    scope = Scope.OPERATE
    needs_lease = True
    slow = True

    task: AnyTask
    timeout: float | None = None
    on_lease_loss: OnLeaseLoss = "stop"
    records: bool = False

    @property
    def required_scope(self) -> Scope:
        """The right that a client needs: also that of the task."""
        return max(self.scope, self.task.scope)


class AddPoints(Command, frozen=True, kw_only=True, tag="add_points"):
    """Upload points of a trajectory too long for one message; answered by :class:`PointsAdded`.

    Attributes:
        points: The next points; all parts have velocities or none, and likewise accelerations.
        upload: Number of the upload that they continue; 0 begins one.
    """

    scope = Scope.OPERATE
    needs_lease = True
    slow = True

    points: TrajectoryValue
    upload: int = 0


class SetJogVelocity(Command, frozen=True, kw_only=True, tag="set_jog_velocity"):
    """Set the velocity of a jog; without another one in time the arm rests, see :class:`Jog`.

    Attributes:
        goal: Number of the jog.
        joints: Velocities of the joints, or null.
        tool: Velocity of the tool, or null; one of the two is given.
    """

    scope = Scope.OPERATE
    needs_lease = True

    goal: int
    joints: OfJoints | None = None
    tool: OfTool | None = None

    def __post_init__(self) -> None:
        check_fields(self)


class GoalCommand(Command, frozen=True):
    """Base of the commands to a goal."""

    scope = Scope.OPERATE
    needs_lease = True

    goal: int


class EndJog(GoalCommand, frozen=True, tag="end_jog"):
    """End a jog; it succeeds once the arm is at rest.

    Attributes:
        goal: Its number.
    """


class Cancel(GoalCommand, frozen=True, tag="cancel"):
    """Bring a goal to rest and end it.

    Attributes:
        goal: Its number.
    """


class PauseGoal(GoalCommand, frozen=True, tag="pause_goal"):
    """Pause a goal on its path.

    Attributes:
        goal: Its number.
    """


class ResumeGoal(GoalCommand, frozen=True, tag="resume_goal"):
    """Continue a paused goal.

    Attributes:
        goal: Its number.
    """


class Pause(Command, frozen=True, tag="pause"):
    """Bring all motion to rest on its path; needs no lease.

    It lasts until :class:`Resume` or a stop, also when its client disconnects. A client of the same
    name may then lift it in its place.

    Attributes:
        may_resume: Whether its client may lift it; a gateway sends false for one that may not
            operate the arm.
    """

    scope = Scope.VIEW

    may_resume: bool = True


class Resume(Command, frozen=True, tag="resume"):
    """Lift the pause of this client; all pauses, if it holds the lease. Needs no lease.

    Motion continues when no pause is left. Refused if the arm is paused by others alone.
    """

    scope = Scope.OPERATE


class SetSpeedOverride(Command, frozen=True, tag="set_speed_override"):
    """Set the share of the planned speed at which the arm moves, 0 to 1.

    Attributes:
        share: The share.
    """

    scope = Scope.OPERATE
    needs_lease = True

    share: float


class StopAll(Query, frozen=True, tag="stop"):
    """Stop all motion on its path; needs no lease, and revokes that of another client."""


class SimulateFault(Command, frozen=True, tag="simulate_fault"):
    """Let a simulated arm fail, also while it moves; refused on a real one. Needs no lease.

    Answered by :class:`Done` once the arm fails.

    Attributes:
        fault: Of a joint ``reset``, ``power``, ``hang``, ``overheat``, ``freeze_encoder``,
            ``obstacle``, ``clear_obstacles`` or ``push``; of the arm ``supply``,
            ``brown_out``, ``bus_flips``, ``bus_loss`` or ``bus_stuck``; or ``clear``, which ends
            all that last.
        joint: The joint; not used by those of the arm.
        value: Whether it is on, 1 or 0; for ``power`` and ``supply`` whether that is on.
            Position of an obstacle; force or torque of a push; time without supply of a
            brown-out, 0.01 to 10 s; share of flipped bits, 0 to 0.01; share of lost exchanges,
            0 to 1. Null for the one that begins it, where it is a switch.
    """

    scope = Scope.OPERATE
    slow = True

    fault: SimulatedFaultName
    joint: str = ""
    value: float | None = None


class Disturbance(Command, frozen=True):
    """Base of the commands that change the world around a simulated arm, also while it moves.

    They are refused for an arm without a world. They need no lease: they are no commands of the
    arm.
    """

    scope = Scope.OPERATE
    slow = True


class PushBody(Disturbance, frozen=True, kw_only=True, tag="push_body"):
    """Push a piece of labware, or a link of the arm.

    Attributes:
        name: Its name; ``link_1`` to ``link_4`` are the arm's.
        force: x, y, z in the base frame, each at most 50 N.
        duration: At most 10 s of the arm's time.
    """

    name: str
    force: tuple[float, float, float]
    duration: float = 0.1


class TiltBody(Disturbance, frozen=True, kw_only=True, tag="tilt_body"):
    """Tilt a nest, a wall or an obstacle about its origin.

    Attributes:
        name: Its name.
        height: By how much the end of a plate that lies on it is raised, 0 to 20 mm; 0 ends it.
        direction: Direction of that end, from the body's x axis.
    """

    name: str
    height: float
    direction: float = 0.0


class AddObstacle(Disturbance, frozen=True, kw_only=True, tag="add_obstacle"):
    """Put a fixed box into the world.

    Attributes:
        name: A new name.
        lower: Smallest x, y, z in the base frame.
        upper: Largest x, y, z.
    """

    name: str
    lower: tuple[float, float, float]
    upper: tuple[float, float, float]


class TakeAway(Disturbance, frozen=True, tag="take_away"):
    """Take labware that is not held, a nest, a wall or an obstacle out of the world.

    Attributes:
        name: Its name.
    """

    name: str


class SetRealTimeFactor(Command, frozen=True, tag="set_real_time_factor"):
    """Let the time of a simulated arm pass faster or slower; refused on a real one.

    Attributes:
        real_time_factor: Simulated time in a second of real time, 0.1 to 20.
    """

    scope = Scope.OPERATE
    needs_lease = True

    real_time_factor: float


class MakePlan(Query, frozen=True, tag="make_plan"):
    """Plan a motion without moving; answered by :class:`PlanMade`. Needs no lease.

    Attributes:
        motion: The motion.
    """

    slow = True

    motion: Motion


class ControllerCommand(Command, frozen=True):
    """Base of the commands to controllers of clients, and to hardware."""

    needs_lease = True
    slow = True


class LoadController(ControllerCommand, frozen=True, kw_only=True, tag="load_controller"):
    """Create a controller, as ros2_control does; answered by :class:`Done`, and nothing moves.

    Attributes:
        name: Its name: letters, digits and underscores. Those of the arm's own begin with ``arm.``.
        type: Its type, as ``forward_command_controller/ForwardCommandController``.
        parameters: Its parameters, as in its section of a parameter file of ROS.
    """

    name: str
    type: str
    parameters: dict[str, Any] = {}


class ConfigureController(ControllerCommand, frozen=True, tag="configure_controller"):
    """Make a controller of a client inactive; answered by :class:`Done`.

    Attributes:
        name: Its name.
    """

    name: str


class CleanupController(ControllerCommand, frozen=True, tag="cleanup_controller"):
    """Make an inactive controller of a client unconfigured; answered by :class:`Done`.

    Attributes:
        name: Its name.
    """

    name: str


class UnloadController(ControllerCommand, frozen=True, tag="unload_controller"):
    """Remove a controller of a client; answered by :class:`Done`.

    Attributes:
        name: Its name.
    """

    name: str


class SwitchControllers(ControllerCommand, frozen=True, tag="switch_controllers"):
    """Change which controllers of clients are active; answered by :class:`Switched`.

    The first one that commands the arm or the gripper begins a goal, which lasts as long as one is
    active: cancelling it, a stop, a fault and the end of the lease deactivate them.

    Attributes:
        activate: Names of controllers to activate.
        deactivate: Names of controllers to deactivate.
        strict: Whether one that cannot be switched refuses all.
    """

    activate: tuple[str, ...] = ()
    deactivate: tuple[str, ...] = ()
    strict: bool = True


class SetHardwareState(ControllerCommand, frozen=True, tag="set_hardware_state"):
    """Bring a hardware component to a lifecycle state; answered by :class:`HardwareState`.

    Attributes:
        component: Its name.
        state: ``unconfigured``, ``inactive``, ``active`` or ``finalized``.
    """

    component: str
    state: LifecycleName


class AddGoalPoints(Command, frozen=True, kw_only=True, tag="add_goal_points"):
    """Upload points of a controller's trajectory; answered by :class:`PointsAdded`.

    Attributes:
        points: The next points.
        upload: Number of the upload that they continue; 0 begins one.
    """

    needs_lease = True

    points: tuple[Point, ...]
    upload: int = 0


class FollowGoal(ControllerCommand, frozen=True, kw_only=True, tag="follow_goal"):
    """Send a goal to a trajectory controller of a client; answered by :class:`ControllerGoal`.

    Attributes:
        controller: Name of the controller, which is active.
        goal: The goal; its ``collision_checked`` is ignored.
        upload: Number of the upload with the points before its own; 0 for none.
    """

    controller: str
    goal: Goal
    upload: int = 0


class StreamTrajectory(ControllerCommand, frozen=True, kw_only=True, tag="stream_trajectory"):
    """Replace the trajectory of a trajectory controller, without a goal; answered by :class:`Done`.

    Attributes:
        controller: Name of the controller, which is active.
        trajectory: The trajectory.
        upload: Number of the upload with the points before its own; 0 for none.
    """

    controller: str
    trajectory: JointTrajectory
    upload: int = 0


class SendGripperGoal(ControllerCommand, frozen=True, tag="send_gripper_goal"):
    """Send a goal to a gripper controller of a client; answered by :class:`ControllerGoal`.

    Attributes:
        controller: Name of the controller, which is active.
        goal: The goal.
    """

    controller: str
    goal: GripperGoal


class TriggerHoming(ControllerCommand, frozen=True, tag="trigger_homing"):
    """Home one joint by a homing controller of a client, or stop that; answered by :class:`Done`.

    Attributes:
        controller: Name of the controller, which is active.
        joint: The joint.
        command: Its sign is the direction; 0 stops.
    """

    controller: str
    joint: str
    command: float


class CommandController(Command, frozen=True, tag="command_controller"):
    """Set the command of a forward command controller of a client; answered by :class:`Done`.

    Attributes:
        controller: Name of the controller, which is active.
        values: One for each of its joints.
    """

    needs_lease = True

    controller: str
    values: tuple[float, ...]


class CancelControllerGoal(ControllerCommand, frozen=True, tag="cancel_controller_goal"):
    """Cancel a goal of a controller; does nothing if it has ended. Answered by :class:`Done`.

    Attributes:
        controller: Name of the controller.
        goal: Number of the goal.
    """

    controller: str
    goal: int


class SetControllerScaling(ControllerCommand, frozen=True, tag="set_controller_scaling"):
    """Choose the share of the planned speed of a trajectory controller; answered by :class:`Done`.

    Attributes:
        controller: Name of the controller, which is active.
        factor: The share; 0 pauses. The arm's own speed override applies too.
    """

    controller: str
    factor: float


class SetControllerParameters(ControllerCommand, frozen=True, tag="set_controller_parameters"):
    """Change parameters of a trajectory controller that may change; answered by :class:`Done`.

    Attributes:
        controller: Name of the controller, which is configured.
        parameters: By the names of ros2_controllers, each as a whole: those of one joint in
            ``gains`` are all of its gains, and a joint that is left out has the defaults.
    """

    controller: str
    parameters: dict[str, Any]


class QueryController(Query, frozen=True, tag="query_controller"):
    """Ask for the :class:`DesiredState` of a trajectory controller at a time.

    Attributes:
        controller: Name of the controller.
        time: A time within its trajectory, on the arm's clock.
    """

    slow = True

    controller: str
    time: float


class GetIntrospection(Query, frozen=True, tag="get_introspection"):
    """Ask for the :class:`Introspection` of the controller manager.

    Attributes:
        thresholds: By which the diagnostics are rated, where they differ from the defaults; their
            names are those of ros2_control behind ``diagnostics.threshold.``, in Hz and us.
    """

    slow = True

    thresholds: dict[str, float] = {}


class AcquireLease(Command, frozen=True, kw_only=True, tag="acquire_lease"):
    """Take the lease, the right to command; answered by :class:`LeaseState`.

    Attributes:
        time_to_live: Time after which it lapses unless it is renewed, 0.2 to 60 s.
        force: Whether to take it from another client; all clients get the event.
    """

    scope = Scope.OPERATE

    time_to_live: float = 2.0
    force: bool = False

    @property
    def required_scope(self) -> Scope:
        """The right that a client needs: to take it from another client, ADMIN."""
        return Scope.ADMIN if self.force else self.scope


class RenewLease(Command, frozen=True, tag="renew_lease"):
    """Let the lease lapse later; answered by :class:`LeaseState`."""

    scope = Scope.OPERATE
    needs_lease = True


class ReleaseLease(Command, frozen=True, tag="release_lease"):
    """Give the lease back; goals that would be stopped by its lapse are stopped."""

    scope = Scope.OPERATE
    needs_lease = True


class GetState(Query, frozen=True, tag="get_state"):
    """Ask for the newest :class:`StateSample`."""


class GetDescription(Query, frozen=True, tag="get_description"):
    """Ask for the :class:`Description` of the arm."""


class GetWorkspace(Query, frozen=True, tag="get_workspace"):
    """Ask for the :class:`WorkspaceState`."""


class GetHistory(Query, frozen=True, kw_only=True, tag="get_history"):
    """Ask for the :class:`History`; the last ten minutes are kept.

    Attributes:
        begin: First time, on the arm's clock; samples before the begin of the history are left out.
        end: Last time; null for now.
        points: Largest number of points, 2 to 5000.
    """

    slow = True

    begin: float
    end: float | None = None
    points: int = 1000


class GetSimulation(Query, frozen=True, tag="get_simulation"):
    """Ask for the :class:`SimulationState`."""


class GetBodies(Query, frozen=True, tag="get_bodies"):
    """Ask for the :class:`BodyList`; refused for an arm without a world."""

    slow = True


class GetWorld(Query, frozen=True, tag="get_world"):
    """Ask for the :class:`WorldSample` of now; refused for an arm without a world."""

    slow = True


class GetImage(Query, frozen=True, kw_only=True, tag="get_image"):
    """Ask for an :class:`ImageFile` of now; refused for an arm without a world.

    Attributes:
        camera: ``front``, ``side``, ``top``, or ``wrist`` on the gripper.
        width: 16 to 2048 pixels.
        height: 16 to 2048 pixels.
    """

    slow = True

    camera: str = "front"
    width: int = 640
    height: int = 480


class GetFaults(Query, frozen=True, tag="get_faults"):
    """Ask for the :class:`FaultList`."""


class GetGoal(Query, frozen=True, tag="get_goal"):
    """Ask for the :class:`GoalState` of a goal.

    Attributes:
        goal: Its number.
    """

    goal: int


class GetTrajectories(Query, frozen=True, tag="get_trajectories"):
    """Ask for the :class:`GoalTrajectories` of a goal; they are kept for the latest 20 goals.

    Attributes:
        goal: Its number.
        first: Index of the first point of each trajectory that is wanted: an answer has 2000.
    """

    slow = True

    goal: int
    first: int = 0


class GetLease(Query, frozen=True, tag="get_lease"):
    """Ask for the :class:`LeaseState`."""


class GetStatistics(Query, frozen=True, tag="get_statistics"):
    """Ask for the :class:`Statistics`."""


class GetJoints(Query, frozen=True, tag="get_joints"):
    """Ask for the :class:`JointList`: identity, state and counters of each joint.

    The counters are read from the joints while nothing moves, at most every 2 s; otherwise they are
    those that were read last.
    """

    slow = True


class GetParameters(Query, frozen=True, tag="get_parameters"):
    """Ask for the :class:`ParametersState`: the overlay of this arm."""

    slow = True


class SetParameters(Command, frozen=True, kw_only=True, tag="set_parameters"):
    """Write the overlay of this arm, checked; it applies from the owner's next start on.

    Attributes:
        overlay: The text of the file.
        revision: Number of the overlay that it replaces.
    """

    needs_lease = True
    slow = True

    overlay: str
    revision: int


class ListControllers(Query, frozen=True, tag="list_controllers"):
    """Ask for the :class:`ControllerList`."""


class ListFlightRecords(Query, frozen=True, tag="list_flight_records"):
    """Ask for the :class:`FlightRecordList`."""


class GetFlightRecord(Query, frozen=True, tag="get_flight_record"):
    """Ask for a :class:`FlightRecordFile`.

    Attributes:
        name: One of the list.
    """

    slow = True

    name: str


class ListGoals(Query, frozen=True, tag="list_goals"):
    """Ask for the :class:`GoalList`."""


class Report(Command, frozen=True, tag="report"):
    """Send a text to all clients, as an event ``report``; needs no lease.

    Attributes:
        text: A sentence of up to 500 characters.
    """

    scope = Scope.OPERATE

    text: str


class GetLog(Query, frozen=True, tag="get_log"):
    """Ask for :class:`LogLines`.

    Attributes:
        after: Number of the line after which to begin.
    """

    after: int = 0


class Subscribe(Command, frozen=True, kw_only=True, tag="subscribe"):
    """Choose the samples and events that the owner sends; answered by :class:`Done`.

    Attributes:
        states: Whether to send state samples; a slow reader gets the latest, never a queue.
        period: Least time between two of them.
        events_after: Number after which to send events, 0 for all that are kept; null for none.
        controllers: Whether to send samples of the clients' controllers, likewise conflated.
        controllers_period: Least time between two of those.
        world: Whether to send samples of the bodies around a simulated arm, likewise conflated; an
            arm without a world sends none.
        world_period: Least time between two of those; the owner makes one in 0.05 s.
        unconfirmed: Number of state samples, and of those of the world, that are sent before the
            client confirms one by :class:`Received`; 0 for no limit. For clients that read without
            processing: a browser takes megabytes for a page that stands still, and would show them
            late.
    """

    scope = Scope.VIEW

    states: bool = False
    period: float = 0.0
    unconfirmed: int = 0
    events_after: int | None = None
    controllers: bool = False
    controllers_period: float = 0.0
    world: bool = False
    world_period: float = 0.0


class Recall(Command, frozen=True, tag="recall"):
    """Ask for the answer to an earlier request of this session, once there is one.

    Answered by that answer; or by :class:`NotArrived` if the request may be sent again, as it never
    arrived or is a query. Refused with an OwnerError if it was so long ago that this is not known
    any more.

    Attributes:
        request: Its number.
    """

    scope = Scope.VIEW

    request: int


AnyCommand = (
    Start
    | AddPoints
    | SetJogVelocity
    | EndJog
    | Cancel
    | PauseGoal
    | ResumeGoal
    | Pause
    | Resume
    | SetSpeedOverride
    | StopAll
    | SimulateFault
    | PushBody
    | TiltBody
    | AddObstacle
    | TakeAway
    | SetRealTimeFactor
    | MakePlan
    | LoadController
    | ConfigureController
    | CleanupController
    | UnloadController
    | SwitchControllers
    | SetHardwareState
    | AddGoalPoints
    | FollowGoal
    | StreamTrajectory
    | SendGripperGoal
    | TriggerHoming
    | CommandController
    | CancelControllerGoal
    | SetControllerScaling
    | SetControllerParameters
    | QueryController
    | GetIntrospection
    | AcquireLease
    | RenewLease
    | ReleaseLease
    | GetState
    | GetDescription
    | GetWorkspace
    | GetHistory
    | GetSimulation
    | GetBodies
    | GetWorld
    | GetImage
    | GetFaults
    | GetGoal
    | GetTrajectories
    | GetLease
    | GetStatistics
    | GetJoints
    | GetParameters
    | SetParameters
    | ListControllers
    | ListFlightRecords
    | GetFlightRecord
    | ListGoals
    | Report
    | GetLog
    | Subscribe
    | Recall
)


# From the client.


class ClientHello(ApiMessage, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="hello"):
    """First message of a client.

    Attributes:
        version: :data:`VERSION` of the client.
        client: Its name, for messages to people.
        session: A random name that it keeps when it connects again, so that it can ask for answers
            that it missed.
    """

    version: int
    client: str
    session: str


class ClientRequest(
    ApiMessage, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="request"
):
    """A request.

    Attributes:
        id: Its number, unique in the session and increasing. A request whose number was seen
            before is not carried out again: its answer is repeated, or it is refused if that is not
            kept any more. Only a :class:`Query` is, or a :class:`RenewLease`.
        command: The request itself.
        epoch: Epoch of the client's lease, for commands that need one.
    """

    id: int
    command: AnyCommand
    epoch: int | None = None


class Received(ApiMessage, frozen=True, forbid_unknown_fields=True, tag="received"):
    """Confirm the samples of state and world up to a cycle; has no answer.

    Attributes:
        cycle: Number of the cycle.
    """

    cycle: int


class Leave(ApiMessage, frozen=True, forbid_unknown_fields=True, tag="leave"):
    """End this client, and its lease if it has one; has no answer.

    A gateway says it for a page that was closed, as that may have no time for it, and for a program
    whose connection has ended.

    Attributes:
        may_return: Whether the client goes on if its session has a connection again within 0.3 s.
    """

    may_return: bool = False


FromClient = ClientHello | ClientRequest | Received | Leave


# From the owner: results.


class Result(ApiMessage, frozen=True):
    """Base of the results."""


class Done(Result, frozen=True, tag="done"):
    """It was done."""


class NotArrived(Result, frozen=True, tag="not_arrived"):
    """The recalled request may be sent again: it has not arrived, or changes nothing."""


class Accepted(Result, frozen=True, tag="accepted"):
    """The goal was accepted, and has begun.

    Attributes:
        goal: The goal as it begins.
    """

    goal: GoalValue


class PlanMade(Result, frozen=True, tag="plan_made"):
    """A plan, kept for :class:`Execute` until 32 others were made.

    Attributes:
        plan: Its number.
        trajectory: Its trajectory, to be shown: of a longer one at most 2001 points, evenly spread.
        notes: Notes on it for the user.
        points: Number of points that the arm would follow.
    """

    plan: int
    trajectory: TrajectoryValue
    notes: tuple[str, ...]
    points: int


class LeaseState(Result, frozen=True, tag="lease_state"):
    """The lease now.

    Attributes:
        lease: The lease.
    """

    lease: LeaseValue


class Description(Result, frozen=True, kw_only=True, tag="description"):
    """Which arm it is.

    Attributes:
        name: Name of the owner.
        arm: Which arm on which bus, in words.
        simulated: Whether it is simulated.
        parameters: Parameters of the arm.
        rate: Control cycles per second [Hz].
        bus_share: Share of each cycle that the exchanges take on the bus.
        firmware: Protocol and firmware versions of each joint, in words.
        software: Version of the owner's software.
    """

    name: str
    arm: str
    simulated: bool
    parameters: ArmParameters
    rate: int
    bus_share: float
    firmware: tuple[str, ...]
    software: str


class WorkspaceState(Result, frozen=True, kw_only=True, tag="workspace_state"):
    """Tool, scene, load and speed limit.

    Attributes:
        revision: Number of the workspace, one higher with each change.
        scene: The scene.
        table: The tools, poses and frames.
        tool: The mounted tool.
        reduced_speed: Whether the tool keeps to 250 mm/s.
        load: The carried load, or null.
        widths: Smallest and largest width that the jaws may have.
        unconfirmed: Values from the owner's last run that are not confirmed, in words; motions are
            refused until then, except jogs.
    """

    revision: int
    scene: SceneValue
    table: TeachTable
    tool: Tool
    reduced_speed: bool
    load: Load | None
    widths: tuple[float, float]
    unconfirmed: tuple[str, ...] = ()


class SimulatedFaultValue(Value, frozen=True):
    """A simulated fault that lasts.

    Attributes:
        fault: Its kind, as of :class:`SimulateFault`.
        joint: The joint; empty if it concerns the whole arm.
        value: As it was given.
        since: When it began, on the arm's clock.
    """

    fault: SimulatedFaultName
    joint: str
    value: float
    since: float


class SimulationState(Result, frozen=True, kw_only=True, tag="simulation"):
    """Faults and speed of a simulated arm.

    Attributes:
        available: Whether faults and speed can be chosen: the owner itself simulates the arm.
        real_time_factor: Simulated time in a second of real time; NaN unless it can be chosen.
        faults: The simulated faults that last, oldest first.
    """

    available: bool
    real_time_factor: float
    faults: tuple[SimulatedFaultValue, ...]


class BodyList(Result, frozen=True, tag="body_list"):
    """The bodies around a simulated arm.

    Attributes:
        version: Number of this list; another one once bodies come or go.
        bodies: Name, kind, whether it moves, and boxes of each.
        poses: Where each was when this list began.
    """

    version: int
    bodies: tuple[BodyShape, ...]
    poses: tuple[BodyPose, ...]


class ImageFile(Result, frozen=True, kw_only=True, tag="image_file"):
    """An image of a simulated arm in its world.

    Attributes:
        time: Begin of the control cycle that it shows, on the arm's clock.
        camera: Where it was taken from.
        data: The image, as a PNG file.
    """

    time: float
    camera: str
    data: bytes


class History(Result, frozen=True, kw_only=True, tag="history"):
    """The arm over a time: lists of one value for each point.

    Where there are more cycles than points, each two points have the smallest and the largest value
    of their cycles, in the order in which they occurred: no peak is lost.

    Attributes:
        oldest: Time of the oldest cycle that is kept; NaN if there is none.
        time: Of each point, on the arm's clock; increasing.
        names: The joints.
        positions: For each joint a list; likewise the next ones.
        velocities: As measured.
        commands: Commanded positions.
        errors: Commanded minus measured position; NaN while the motors are not energised.
        loads: Position errors as a share of the stall threshold [%], as of the samples; NaN where a
            joint reported none, null if none ever did.
        late: How much later than due the cycle began.
        bus_time: Duration of its exchanges.
    """

    oldest: float
    time: tuple[float, ...]
    names: tuple[str, ...]
    positions: tuple[tuple[float, ...], ...]
    velocities: tuple[tuple[float, ...], ...]
    commands: tuple[tuple[float, ...], ...]
    errors: tuple[tuple[float, ...], ...]
    loads: tuple[tuple[float, ...], ...] | None
    late: tuple[float, ...]
    bus_time: tuple[float, ...]


class FaultList(Result, frozen=True, tag="fault_list"):
    """The faults that are not recovered from.

    Attributes:
        state: ``clear``, ``stopping``, ``latched`` or ``acknowledged``.
        faults: First cause first.
        warnings: The latest events that stopped nothing; each begins with the call it concerns.
            Those of a motion go only to the client that began it.
        warned: When each of them happened, on the arm's clock.
    """

    state: FaultState
    faults: tuple[FaultValue, ...]
    warnings: tuple[str, ...]
    warned: tuple[float, ...] = ()


class GoalState(Result, frozen=True, tag="goal_state"):
    """A goal now.

    Attributes:
        goal: The goal.
    """

    goal: GoalValue


class GoalList(Result, frozen=True, tag="goal_list"):
    """The latest goals, oldest first.

    Attributes:
        goals: The goals.
    """

    goals: tuple[GoalValue, ...]


class PointsAdded(Result, frozen=True, tag="points_added"):
    """Points of a trajectory were uploaded.

    Attributes:
        upload: Number of the upload, for the next part or for :class:`Follow`.
        count: Number of its points so far.
    """

    upload: int
    count: int


class GoalTrajectories(Result, frozen=True, tag="goal_trajectories"):
    """The trajectories that a goal follows, one after another.

    Attributes:
        goal: Number of the goal.
        trajectories: A ramp to the start, if there is one, and the planned one; empty for goals
            that follow none. Of each at most 2000 points, from the ``first`` that was asked for on.
        points: Number of points of the longest one.
    """

    goal: int
    trajectories: tuple[TrajectoryValue, ...]
    points: int = 0


class Statistics(Result, frozen=True, kw_only=True, tag="statistics"):
    """Statistics of the control loop and of the owner.

    Attributes:
        cycles: Control cycles since the owner began.
        overruns: Cycles that had not ended when the next was due.
        rate: Cycles of the last second of real time [Hz].
        late: 50th and 99th percentile and maximum of the delay at their begin, also of a simulated
            arm in real time.
        read: Likewise, of the time that reading the joints took.
        update: Likewise, of controllers and limits.
        write: Likewise, of writing.
        clients: Open connections.
        memory: Resident memory of the owner, without the processes that compute [byte].
        uptime: Time since the owner began.
    """

    cycles: int
    overruns: int
    rate: int
    late: tuple[float, float, float]
    read: tuple[float, float, float]
    update: tuple[float, float, float]
    write: tuple[float, float, float]
    clients: int
    memory: int
    uptime: float


class JointList(Result, frozen=True, tag="joint_list"):
    """The joints, as they describe themselves.

    Attributes:
        joints: In the order of the arm.
        counted: When their counters were read last, on the arm's clock; NaN if they never were.
    """

    joints: tuple[JointValue, ...]
    counted: float


class ParametersState(Result, frozen=True, tag="parameters_state"):
    """The overlay of this arm.

    Attributes:
        revision: Its number, one higher with each change.
        overlay: Its text; empty if there is none.
        restart: Whether it was changed since the owner began, which applies it when it starts.
    """

    revision: int
    overlay: str
    restart: bool


class InterfaceValue(Value, frozen=True):
    """One interface of a hardware component.

    Attributes:
        name: As ``j1/position``.
        available: Whether it can be used.
        claimed: Whether a controller commands it.
    """

    name: str
    available: bool
    claimed: bool


class ControllerValue(Value, frozen=True):
    """One controller.

    Attributes:
        name: Its name.
        type: Its type.
        state: Its lifecycle state.
        update_rate: Updates per second [Hz].
        claimed: Command interfaces that it has.
        commands: Command interfaces that it needs.
        states: State interfaces that it reads.
    """

    name: str
    type: str
    state: LifecycleName
    update_rate: float
    claimed: tuple[str, ...]
    commands: tuple[str, ...]
    states: tuple[str, ...]


class ComponentValue(Value, frozen=True):
    """One hardware component.

    Attributes:
        name: Its name.
        type: ``system``, ``actuator`` or ``sensor``.
        plugin: The class behind it.
        state: Its lifecycle state.
        rate: How often it is read and written [Hz].
        commands: Its command interfaces.
        states: Its state interfaces.
    """

    name: str
    type: str
    plugin: str
    state: LifecycleName
    rate: int
    commands: tuple[InterfaceValue, ...]
    states: tuple[InterfaceValue, ...]


class ControllerList(Result, frozen=True, tag="controller_list"):
    """All controllers and hardware components.

    Attributes:
        controllers: In the order of updates.
        components: In the order in which they are read.
        types: Names of the controller types that can be loaded.
    """

    controllers: tuple[ControllerValue, ...]
    components: tuple[ComponentValue, ...]
    types: tuple[str, ...]


class FlightRecordList(Result, frozen=True, tag="flight_record_list"):
    """The flight records of faults.

    Attributes:
        names: Oldest first.
    """

    names: tuple[str, ...]


class FlightRecordFile(Result, frozen=True, tag="flight_record_file"):
    """A flight record.

    Attributes:
        name: Its name.
        data: The file, as MCAP.
    """

    name: str
    data: bytes


class LogLines(Result, frozen=True, tag="log_lines"):
    """The latest lines of the owner's log.

    Attributes:
        last: Number of the last line.
        lines: The lines.
    """

    last: int
    lines: tuple[str, ...]


class Switched(Result, frozen=True, tag="switched"):
    """Controllers were switched.

    Attributes:
        text: What ros2_control answers.
    """

    text: str


class HardwareState(Result, frozen=True, tag="hardware_state"):
    """State of a hardware component.

    Attributes:
        component: Its name.
        state: The state that it has reached.
    """

    component: str
    state: LifecycleName


class ControllerGoal(Result, frozen=True, tag="controller_goal"):
    """A controller has accepted a goal; its end is among those of a :class:`ControllersSample`.

    Attributes:
        goal: Its number, counted from 1 since the owner began, over all controllers.
    """

    goal: int


class DesiredState(Result, frozen=True, tag="desired_state"):
    """State of a controller's trajectory at a time.

    Attributes:
        names: The joints.
        state: Their positions, velocities and accelerations.
    """

    names: tuple[str, ...]
    state: Sample


class DiagnosticValue(Value, frozen=True):
    """One status of the diagnostics, as ros2_control publishes it.

    Attributes:
        name: Its subject.
        level: 0 if all is well, 1 for a warning, 2 for an error.
        message: Why, in words.
        values: The details, by name.
    """

    name: str
    level: int
    message: str
    values: dict[str, str]


class Introspection(Result, frozen=True, tag="introspection"):
    """Values and diagnostics of the controller manager.

    Attributes:
        values: Of interfaces and statistics, by their names in pal_statistics of ROS.
        diagnostics: Of controllers, hardware and manager.
    """

    values: dict[str, float]
    diagnostics: tuple[DiagnosticValue, ...]


class StateSample(Result, frozen=True, kw_only=True, tag="state"):
    """The arm at the end of a control cycle.

    Attributes:
        cycle: Number of the cycle.
        time: Its begin, on the arm's clock.
        names: The joints.
        positions: Of the joints.
        velocities: Of the joints.
        qualities: Reliability of the positions: 0 fresh, 1 stale, 2 assumed, 3 unknown.
        stamps: When they were measured.
        flags: Flags that the joints reported.
        commands: Commanded positions.
        pose: Pose of the tool in the base; null unless all joints are homed.
        width: Last commanded width of the jaws; NaN while the servo is not driven.
        enabled: Whether the motors are energised.
        fault: ``clear``, ``stopping``, ``latched`` or ``acknowledged``.
        paused: Whether all motion is paused.
        paused_by: Names of the clients that paused it, oldest first.
        speed_override: Share of the planned speed.
        moving: Names of the operations that use the arm or the gripper.
        late: How much later than due the cycle began; of a simulated arm too in real time.
        bus_time: Duration of its exchanges.
        stale: Whether the joints are not read now, as after a loss of the bus: then positions are
            unknown.
        loads: Position errors as a share of the stall threshold [%], 0 without power; NaN for a
            joint that does not report it, null if none does. Joints with their original firmware
            never do. While joints follow setpoints on a slow bus they take turns, and each value
            may be some cycles old.
        limitation: Why the running jog does not fully follow its velocity; null if it does, or if
            none runs.
    """

    cycle: int
    time: float
    names: tuple[str, ...]
    positions: tuple[float, ...]
    velocities: tuple[float, ...]
    qualities: tuple[int, ...]
    stamps: tuple[float, ...]
    flags: tuple[int, ...]
    commands: tuple[float, ...]
    pose: Pose | None
    width: float
    enabled: bool
    fault: FaultState
    paused: bool
    speed_override: float
    moving: tuple[str, ...]
    late: float
    bus_time: float
    stale: bool = False
    loads: tuple[float, ...] | None = None
    limitation: JogLimitation | None = None
    paused_by: tuple[str, ...] = ()


class WorldSample(Result, frozen=True, kw_only=True, tag="world"):
    """The bodies around a simulated arm at the end of a control cycle.

    Attributes:
        cycle: Number of the cycle, as of :class:`StateSample`.
        time: Its begin, on the arm's clock.
        version: Number of the :class:`BodyList` that it belongs to.
        held: Name of the body that both jaws press on; null if there is none.
        width: True width between the jaws.
        poses: The bodies that are not where that list says: each sample has all of these.
    """

    cycle: int
    time: float
    version: int
    held: str | None
    width: float
    poses: tuple[BodyPose, ...]


AnyResult = (
    Done
    | NotArrived
    | Accepted
    | PlanMade
    | LeaseState
    | Description
    | WorkspaceState
    | History
    | SimulationState
    | BodyList
    | ImageFile
    | FaultList
    | GoalState
    | GoalList
    | PointsAdded
    | GoalTrajectories
    | Statistics
    | JointList
    | ParametersState
    | ControllerList
    | FlightRecordList
    | FlightRecordFile
    | LogLines
    | Switched
    | HardwareState
    | ControllerGoal
    | DesiredState
    | Introspection
    | StateSample
    | WorldSample
)


# From the owner: messages.


class Welcome(ApiMessage, frozen=True, kw_only=True, tag="welcome"):
    """Answer to :class:`ClientHello`.

    Attributes:
        version: :data:`VERSION` of the owner.
        owner: Name of the owner.
        instance: A random name of this run of the owner: it differs after a restart.
        arm: Which arm on which bus, in words.
        last_event: Number of the newest event; 0 if there is none.
        resumed: Whether the session was known.
    """

    version: int
    owner: str
    instance: str
    arm: str
    last_event: int
    resumed: bool


class Response(ApiMessage, frozen=True, tag="response"):
    """Answer to a request that was carried out.

    Attributes:
        id: Number of the request.
        result: Its result.
    """

    id: int
    result: AnyResult


class RequestFailed(ApiMessage, frozen=True, tag="refusal"):
    """Answer to a request that was refused, or that failed.

    Attributes:
        id: Number of the request; null if it could not be read, and the connection ends.
        failure: Why.
    """

    id: int | None
    failure: FailureValue


class Event(ApiMessage, frozen=True, kw_only=True, tag="event"):
    """Something that happened, numbered.

    Attributes:
        number: Counted from 1 since the owner began.
        time: When, on the arm's clock.
        wall: When, in seconds since 1970.
        what: Its kind.
        text: A sentence for people.
        client: The client that caused it; empty if none did.
        goal: The goal that it concerns, as it is then; else null.
        fault: The fault that it concerns; else null.
        lease: The lease that it concerns; else null.
    """

    number: int
    time: float
    wall: float
    what: EventKind
    text: str
    client: str = ""
    goal: GoalValue | None = None
    fault: FaultValue | None = None
    lease: LeaseValue | None = None


class GoalCycle(ApiMessage, frozen=True, tag="cycle"):
    """Record of a control cycle of a goal, for its client.

    Attributes:
        goal: Number of the goal.
        record: The record; left out if the client reads too slowly.
    """

    goal: int
    record: CycleRecord


class TrajectoryStatus(Value, frozen=True, kw_only=True, tag_field="kind", tag="trajectory"):
    """An active trajectory controller of a client in a cycle, as ``ControllerState``.

    Attributes:
        name: Its name.
        time: Begin of the cycle, on the arm's clock.
        joints: Its joints.
        trajectory_time: Time since the start of its trajectory, or since it holds.
        reference: Desired state of the joints.
        feedback: Their measured state.
        error: Reference minus feedback.
        output: Value of each command interface, by name.
        scaling: Share of the planned speed.
        point: Index of the point that is approached.
        goal: Number of the goal that runs; null if none does.
    """

    name: str
    time: float
    joints: tuple[str, ...]
    trajectory_time: float
    reference: Sample
    feedback: Sample
    error: Sample
    output: dict[str, float]
    scaling: float
    point: int
    goal: int | None


class GripperStatus(Value, frozen=True, kw_only=True, tag_field="kind", tag="gripper"):
    """An active gripper controller of a client in a cycle.

    Attributes:
        name: Its name.
        joint: Its joint.
        goal: Number of the goal that runs; null if none does.
        position: Width between the jaws.
        velocity: As measured.
        effort: Unknown, as the servo reports none: NaN.
        reached: Whether the last goal ended at its width; false while one runs.
        stalled: Whether the jaws were held up before; false while one runs.
    """

    name: str
    joint: str
    goal: int | None
    position: float
    velocity: float
    effort: float
    reached: bool
    stalled: bool


class EndedGoal(Value, frozen=True):
    """How a goal of a client's controller ended.

    Attributes:
        goal: Its number.
        controller: Name of the controller.
        status: ``succeeded``, ``aborted`` or ``canceled``.
        error_code: As of control_msgs/FollowJointTrajectory; 0 for those of other controllers.
        text: Why it ended early; also ROS's text of a success.
        gripper: How the jaws ended, for goals of a gripper controller; else null.
    """

    goal: int
    controller: str
    status: GoalStatus
    error_code: int
    text: str
    gripper: GripperValue | None = None


class ControllersSample(ApiMessage, frozen=True, kw_only=True, tag="controllers_sample"):
    """Interfaces and clients' controllers at the end of a control cycle.

    Attributes:
        cycle: Number of the cycle, as of :class:`StateSample`.
        time: Its begin, on the arm's clock.
        wall: Its begin, in seconds since 1970.
        state_names: All state interfaces, as ``j1/position``, of available hardware or not.
        states: Their values.
        command_names: All command interfaces.
        commands: Their values.
        active: Names of the active controllers of clients.
        controllers: One for each of them that follows trajectories or moves the gripper.
        ended: The last 16 goals of them that ended, oldest first: no end is lost where samples are.
        activity: Grows when a controller or component is added, removed or changes state.
    """

    cycle: int
    time: float
    wall: float
    state_names: tuple[str, ...]
    states: tuple[float, ...]
    command_names: tuple[str, ...]
    commands: tuple[float, ...]
    active: tuple[str, ...]
    controllers: tuple[TrajectoryStatus | GripperStatus, ...]
    ended: tuple[EndedGoal, ...]
    activity: int


FromOwner = (
    Welcome
    | Response
    | RequestFailed
    | StateSample
    | ControllersSample
    | WorldSample
    | Event
    | GoalCycle
)
