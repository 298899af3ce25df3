"""A trajectory carried out by ``bioscara run`` or ``demo``: check, home, follow, stop, report."""

from __future__ import annotations

import math
from contextlib import nullcontext
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import NamedTuple, Protocol

from bioscara.cli.arm_parameters import overlay_notes
from bioscara.cli.motion import Progress, tool_line
from bioscara.cli.opened_arm import (
    acknowledge_faults,
    at_full_speed,
    introduce,
    left,
    open_arm,
    remedy,
    require_acknowledgement,
)
from bioscara.cli.output.angles import angle_unit
from bioscara.cli.output.console import ExitStatus, Output, complain
from bioscara.cli.output.display import make_view
from bioscara.cli.output.observer import Observer
from bioscara.cli.owner_link import served_robot
from bioscara.cli.parser import Options
from bioscara.cli.signals import StopRequest
from bioscara.cli.terminal.keyboard import motion_keys
from bioscara.control.loop.realtime import realtime
from bioscara.errors import BioscaraError, InvalidArgumentError, MotionCancelledError, ZoneError
from bioscara.extras import install
from bioscara.model import ArmParameters
from bioscara.planning import Trajectory, check, fit as stretch, read, write_csv
from bioscara.planning.collision.scene import Scene
from bioscara.report import CycleHistory, JointInfo, Outcome, RunFolder, RunSummary, png, text
from bioscara.report.folder import TRAJECTORY, default_path
from bioscara.robot.arm_methods import ArmMethods
from bioscara.robot.operations.motions.follow_trajectory import checked
from bioscara.robot.planner import Plan, Planner
from bioscara.robot.workspace.workspace import Workspace
from bioscara.version import __version__

_HOMING_CYCLES = 10_000
"""Upper bound of the number of records of homing and approach."""


def describe(job: Job, parameters: ArmParameters, options: Options, output: Output) -> None:
    """Print the duration of the trajectory and the notes on it; nothing moves."""
    planned, notes = job.planned, job.notes
    if options.arm is not None:
        plan = _plan_for_owner(job, options)
        planned, notes = plan.trajectory, tuple(dict.fromkeys(job.notes + plan.notes))
    output.line(f"trajectory: {job.source}, {planned.duration:.2f} s")
    for note in (*notes, *_held(job.trajectory, planned, parameters, options)):
        output.line(f"note: {note}")


def _plan_for_owner(job: Job, options: Options) -> Plan:
    """Return the plan in the workspace of a served arm, from where its other joints are."""
    with served_robot(options) as robot:
        workspace = robot.plan.workspace
        if options.surroundings is not None:
            workspace = workspace.with_scene(job.scene)
        if options.full_speed:
            workspace = workspace.with_reduced_speed(False)
        joints, positions = robot.parameters.joints, robot.state.positions
    here = [
        joint.home_position if math.isnan(position) else position
        for joint, position in zip(joints, positions, strict=True)
    ]
    return checked(job.trajectory, Planner(workspace, lambda: here))


def _held(
    trajectory: Trajectory, planned: Trajectory, parameters: ArmParameters, options: Options
) -> tuple[str, ...]:
    """Return a note on the joints that a trajectory does not name, if there are any."""
    angles = angle_unit(options)
    places = [
        f"{joint.name} at {angles.quantity(position, joint.unit)}"
        for joint, position in zip(parameters.joints, planned.positions[0].tolist(), strict=True)
        if joint.name not in trajectory.joint_names
    ]
    return (f"held, as not in the trajectory: {', '.join(places)}",) if places else ()


@dataclass(frozen=True, slots=True)
class Job:
    """A trajectory that was checked to be executable.

    Attributes:
        title: Name of the run.
        source: Origin of the trajectory, in words.
        trajectory: Trajectory to execute.
        planned: The same as the arm follows it, slowed down and averaged, of all joints.
        notes: Notes on the trajectory for the user.
        scene: Surroundings to keep clear of, also during the motion to the start.
    """

    title: str
    source: str
    trajectory: Trajectory
    planned: Trajectory
    notes: tuple[str, ...]
    scene: Scene

    @property
    def introduction(self) -> str:
        """The job in words, for its begin."""
        return f"trajectory: {self.source}, {self.planned.duration:.2f} s"

    def cycles(self, period: float) -> int:
        """Return how many records its motion has, about."""
        return int(self.planned.duration / period)

    def keep(self, folder: RunFolder) -> None:
        """Write the plan into the folder of the run."""
        _keep_trajectory(folder, self.planned)

    def perform(
        self, robot: ArmMethods, folder: RunFolder, progress: Progress, options: Options
    ) -> JobResult:
        """Move the arm, which is homed."""
        planned = self.planned
        names = [joint.name for joint in robot.parameters.joints]
        if options.arm is not None or len(self.trajectory.joint_names) < len(names):
            # Where the other joints are; an owner has its own speed, tool and load.
            planned = checked(self.trajectory, robot.plan).trajectory
            _keep_trajectory(folder, planned)
        progress.phase("following the trajectory")
        motion = robot.follow(self.trajectory, approach=True, on_cycle=progress.cycle)
        # Those of an owner: it has its own speed, tool and load.
        notes = tuple(f"note: {note}" for note in motion.notes if note not in self.notes)
        held = _held(self.trajectory, planned, robot.parameters, options)
        return JobResult(planned.duration, notes, held)


class JobResult(NamedTuple):
    """Result of a job.

    Attributes:
        duration: Of the motion [s]; NaN if it did not end.
        notes: Notes on it that are known only afterwards.
        facts: Notes for the report alone.
        measured: Measurements in the simulated world, in words.
    """

    duration: float = math.nan
    notes: tuple[str, ...] = ()
    facts: tuple[str, ...] = ()
    measured: tuple[str, ...] = ()


class AnyJob(Protocol):
    """A run of a command: a trajectory to follow, or an object to carry."""

    @property
    def title(self) -> str:
        """Name of the run."""

    @property
    def source(self) -> str:
        """Origin of the motion, in words."""

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes for the user."""

    @property
    def scene(self) -> Scene:
        """Surroundings to keep clear of."""

    @property
    def introduction(self) -> str:
        """The job in words, for its begin."""

    def cycles(self, period: float) -> int:
        """Return how many records its motion has, about."""

    def keep(self, folder: RunFolder) -> None:
        """Write the plan into the folder of the run."""

    def perform(
        self, robot: ArmMethods, folder: RunFolder, progress: Progress, options: Options
    ) -> JobResult:
        """Move the arm, which is homed."""


def prepare(
    path: Path,
    title: str,
    source: str,
    parameters: ArmParameters,
    scene: Scene,
    *,
    fit: bool = False,
    full_speed: bool = False,
) -> Job:
    """Read a trajectory file and check that the arm can execute it.

    Args:
        path: The file.
        title: Name of the run.
        source: Origin of the trajectory, in words.
        parameters: Parameters of the arm; the trajectory must be within its limits.
        scene: Surroundings to keep clear of.
        fit: Whether to stretch the trajectory in time where it is too fast for a joint.
        full_speed: Whether the tool may be faster than 250 mm/s.

    Raises:
        TrajectoryError: The file cannot be read, or the arm cannot execute its trajectory.
        ZoneError: The path of the trajectory is not free.
    """
    trajectory, notes = read(path)
    if fit:
        trajectory, factor = stretch(trajectory, parameters.joints)
        if factor > 1.0:
            notes += (f"stretched in time by {factor:.4f} to fit the limits",)
    homed = [joint.home_position for joint in parameters.joints]
    planner = Planner(
        Workspace.of(parameters, reduced_speed=not full_speed).with_scene(scene), lambda: homed
    )
    # Positions of joints that it does not name are known only after homing: then everything is
    # planned again.
    others = [name for name in planner.joint_names if name not in trajectory.joint_names]
    try:
        plan = checked(trajectory, planner)
    except ZoneError as error:
        if not others:
            raise
        where = ", ".join(others)
        notes += (*check(trajectory, parameters.joints), f"with {where} as homed: {error}")
        planned = trajectory.completed(planner.joint_names, homed)
        return Job(title, source, trajectory, planned, notes, scene)
    return Job(title, source, trajectory, plan.trajectory, notes + plan.notes, scene)


class _Result(NamedTuple):
    """Result of a motion: fields of :class:`RunSummary`, and the result of the job."""

    outcome: Outcome
    message: str
    faults: tuple[str, ...]
    warnings: tuple[str, ...]
    done: JobResult


def run_job(job: AnyJob, parameters: ArmParameters, options: Options, output: Output) -> ExitStatus:
    """Home the arm, carry out the job, leave the arm disabled and write the report.

    Raises:
        BioscaraError: The run was refused or failed before anything moved.
        OSError: Standard output cannot be written.
    """
    started = datetime.now().astimezone()
    path = options.out or default_path(Path("runs"), job.title, started)
    priority = nullcontext() if options.priority is None else realtime(options.priority)
    with StopRequest() as cancelled, priority, open_arm(options, parameters, path) as robot:
        if options.arm is None or options.surroundings is not None:
            robot.scene = job.scene
        introduce(robot, options, output.line)
        require_acknowledgement(robot, options)
        output.line(job.introduction)
        for note in job.notes:
            output.line(f"note: {note}")
        names = tuple(joint.name for joint in robot.parameters.joints)
        folder = RunFolder.create(
            path,
            names,
            _HOMING_CYCLES + job.cycles(robot.period),
        )
        try:
            job.keep(folder)
        except InvalidArgumentError:
            folder.discard()
            raise
        acknowledge_faults(robot, output.line)
        history = CycleHistory(names)
        angles = angle_unit(options)
        units = [(joint.name, joint.unit) for joint in robot.parameters.joints]
        view = make_view(output, units, angles, tool_line(robot, angles))
        with (
            motion_keys(output) as keyboard,
            Observer(view, folder.samples, history) as observer,
            at_full_speed(robot, options),
        ):
            progress = Progress(robot, observer, keyboard)
            result = _move(robot, job, folder, progress, observer, options, cancelled)
        summary = RunSummary(
            title=job.title,
            arm=robot.description,
            source=job.source,
            version=__version__,
            started=started,
            outcome=result.outcome,
            message=result.message,
            joints=tuple(
                JointInfo(joint.name, joint.address, joint.unit, firmware)
                for joint, firmware in zip(robot.parameters.joints, robot.firmware, strict=True)
            ),
            planned_duration=result.done.duration,
            notes=(
                *overlay_notes(options, parameters),
                *job.notes,
                *result.done.facts,
                *result.warnings,
            ),
            faults=result.faults,
            measured=result.done.measured,
        )
    return _finish(summary, history, folder, observer.problem, output)


def _keep_trajectory(folder: RunFolder, planned: Trajectory) -> None:
    try:
        write_csv(folder.path / TRAJECTORY, planned)
    except OSError as error:
        raise InvalidArgumentError(
            f"{folder.path / TRAJECTORY} cannot be written: {error.strerror or error}; "
            f"choose another folder with --out"
        ) from error


def _move(
    robot: ArmMethods,
    job: AnyJob,
    folder: RunFolder,
    progress: Progress,
    observer: Observer,
    options: Options,
    cancelled: StopRequest,
) -> _Result:
    """Move the arm, leave it at rest and return the result."""
    outcome, message = Outcome.COMPLETED, ""
    faults: tuple[str, ...] = ()
    done = JobResult()
    try:
        with cancelled.ending_calls_of(robot):
            progress.phase("homing " + ", ".join(robot.parameters.homing_order))
            robot.home(on_cycle=progress.cycle)
            done = job.perform(robot, folder, progress, options)
    except MotionCancelledError as error:
        outcome, message = Outcome.CANCELLED, f"{error}; {left(options)}"
    except BioscaraError as error:
        faults = tuple(map(str, robot.faults)) or (str(error),)
        outcome, message = Outcome.FAILED, faults[0] + remedy(robot)
    if options.arm is None:
        observer.phase("stopping and disabling all joints")
    problems = robot.shutdown()
    if problems and outcome is not Outcome.FAILED:
        outcome, message = Outcome.FAILED, problems[0]
    for note in done.notes:
        progress.note(note)
    warnings = (*progress.warnings, *done.notes)
    return _Result(outcome, message, (*faults, *problems), warnings, done)


def _finish(
    summary: RunSummary, history: CycleHistory, folder: RunFolder, problem: str, output: Output
) -> ExitStatus:
    """Write the files, show the report, return the exit status."""
    written, problems = folder.finish(summary, history)
    output.line()
    output.lines([*text.render(summary, history).splitlines(), ""])
    for path in written:
        output.line(f"wrote {path}")
    if not png.available():
        output.line(f"no plot.png: matplotlib is not installed: {install('plot')}")
    if problem:
        problems.insert(0, problem)
    for sentence in problems:
        complain(sentence)
    if summary.outcome is not Outcome.COMPLETED:
        complain(summary.message)
    output.check()
    if summary.outcome is Outcome.CANCELLED:
        return ExitStatus.INTERRUPTED
    return ExitStatus.FAILED if problems or summary.outcome is Outcome.FAILED else ExitStatus.OK
