"""What ``bioscara view`` shows without an owner: files, a plan, a simulated arm."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

import numpy as np

from bioscara.api.messages import TrajectoryValue
from bioscara.api.values import trajectory_value, workspace_value
from bioscara.cli.commands.serving.view import has_target
from bioscara.cli.parser import Options
from bioscara.cli.shared_arguments import START
from bioscara.cli.target import plan_target, scene_from, target_planner
from bioscara.dashboard.viewed import Viewed
from bioscara.errors import BioscaraError, ConfigurationError, InvalidArgumentError, TrajectoryError
from bioscara.model import ArmParameters
from bioscara.planning import Trajectory, check, read
from bioscara.planning.arrays import Array
from bioscara.report.folder import SAMPLES
from bioscara.report.recorded import read_run
from bioscara.robot.workspace.workspace import Workspace
from bioscara.sim import Onlooker

SERVED = "arm:"
"""Begin of a SOURCE that names an arm with an owner."""
_SIMULATED = "sim:"
_ROWS = 20_000
"""Largest number of samples of a motion."""
_PERIOD = 0.01
"""Time between two samples of a trajectory whose least clearance is looked for [s]."""


def is_arm(source: str) -> bool:
    """Return whether SOURCE names an arm, and not a file or folder."""
    return source == "sim" or source.startswith((_SIMULATED, SERVED, "linux:"))


def onlooker_of(source: str) -> Onlooker:
    """Return an observer of a running simulated arm.

    Args:
        source: Name of its bus.

    Raises:
        InvalidArgumentError: The arm cannot be shown.
        BusUnavailableError: No arm answers behind the socket.
    """
    path = source.removeprefix(_SIMULATED) if source.startswith(_SIMULATED) else ""
    if not path:
        other = "a real arm has one host" if source.startswith("linux:") else "it has no process"
        raise InvalidArgumentError(
            f"{source}: an arm is shown live only as arm:NAME, which 'bioscara serve' runs, or as "
            f"sim:/path.sock, which 'bioscara simulate --socket /path.sock' runs ({other}); for "
            "this one, name the folder of its run"
        )
    onlooker = Onlooker(path)
    onlooker.look()  # so that a wrong path is refused at once
    return onlooker


def viewed_from(options: Options, parameters: ArmParameters) -> Viewed:
    """Return the source of the options: a file, the plan to a target, an arm, or none of these.

    Args:
        options: Parsed options; a source among them names no arm with an owner.
        parameters: Parameters of the arm.

    Raises:
        BioscaraError: It cannot be read or planned; the message says why.
    """
    if has_target(options):
        planner = target_planner(options, parameters)
        plan = plan_target(planner, options)
        space = planner.workspace
        return _trajectory("plan", plan.trajectory, plan.notes, parameters, space)
    space = Workspace.of(parameters).with_scene(scene_from(options))
    source = options.source
    if source is None or is_arm(source):
        title = source or "the arm, with a slider for each joint"
        state = workspace_value(space, 0)
        return Viewed(title, parameters, state, START, live=source is not None)
    path = Path(source)
    if path.name == SAMPLES and path.is_file():
        raise InvalidArgumentError(
            f"{path} are the samples of a run; name its folder: bioscara view {path.parent}"
        )
    if path.is_dir():
        return _run(path, parameters, space)
    if path.suffix == ".mcap":
        return _recording(path, parameters, space)
    trajectory, notes = read(path)
    try:
        notes += tuple(check(trajectory, parameters.joints))
        space.surroundings.check(space.kinematics, trajectory, START)
    except BioscaraError as error:
        notes += (f"'bioscara run' refuses it: {error}",)
    return _trajectory(str(path), trajectory, notes, parameters, space)


def _trajectory(
    title: str,
    trajectory: Trajectory,
    notes: tuple[str, ...],
    parameters: ArmParameters,
    space: Workspace,
) -> Viewed:
    names = [joint.name for joint in parameters.joints]
    for name in trajectory.joint_names:
        if name not in names:
            raise TrajectoryError(f"{name} is not a joint of the arm; it has {', '.join(names)}")
    if missing := [name for name in names if name not in trajectory.joint_names]:
        notes += (f"it does not say where {', '.join(missing)} is: shown at a chosen position",)
    count = min(int(trajectory.duration / _PERIOD) + 2, _ROWS)
    times = np.linspace(0.0, trajectory.duration, count)
    positions = np.tile(START, (count, 1))
    columns = [names.index(name) for name in trajectory.joint_names]
    positions[:, columns] = trajectory.sample_many(times)[0]
    notes += _least_clearance(space, times, positions)
    state, motion = workspace_value(space, 0), trajectory_value(trajectory)
    return Viewed(title, parameters, state, START, notes, motion)


def _run(folder: Path, parameters: ArmParameters, space: Workspace) -> Viewed:
    if not (folder / SAMPLES).exists():
        runs = sorted(folder.glob(f"*/{SAMPLES}"), key=lambda path: path.stat().st_mtime)
        hint = (
            f"name one in it, such as the last: bioscara view {runs[-1].parent}"
            if runs
            else "name one that 'bioscara run' wrote"
        )
        raise ConfigurationError(
            f"{folder} is not the folder of a run, as it has no {SAMPLES}; {hint}"
        )
    times, phases, positions, skipped = read_run(folder, [each.name for each in parameters.joints])
    parts = [phase.value for phase in phases]
    return _measured(f"run {folder}", times, positions, parts, skipped, parameters, space)


def _recording(path: Path, parameters: ArmParameters, space: Workspace) -> Viewed:
    # Imported here: other sources do without mcap.
    from bioscara.recording.reading.joint_motion import read_motion  # noqa: PLC0415

    times, positions, moving, skipped = read_motion(path, [each.name for each in parameters.joints])
    return _measured(f"recording {path}", times, positions, moving, skipped, parameters, space)


def _measured(
    title: str,
    times: Array,
    positions: Array,
    parts: Sequence[str],
    skipped: float,
    parameters: ArmParameters,
    space: Workspace,
) -> Viewed:
    notes: tuple[str, ...] = ()
    if skipped > 0.0:
        notes = (f"the first {skipped:.1f} s, until all joints were homed, are left out",)
    notes += _least_clearance(space, times, positions)
    begins = [next(rows) for _, rows in groupby(range(len(parts)), parts.__getitem__)]
    phases = tuple((float(times[row]), parts[row]) for row in begins)
    # Also the last one, where the arm has come to rest.
    rows = np.unique(np.linspace(0, len(times) - 1, min(len(times), _ROWS)).astype(int))
    names = tuple(joint.name for joint in parameters.joints)
    values = tuple(map(tuple, positions[rows].tolist()))
    motion = TrajectoryValue(names, tuple(times[rows].tolist()), values, None, None)
    return Viewed(title, parameters, workspace_value(space, 0), START, notes, motion, phases)


def _least_clearance(space: Workspace, times: Array, positions: Array) -> tuple[str, ...]:
    arm, scene = space.kinematics, space.surroundings
    row = int(np.argmin(scene.clearance(arm, positions)))
    pair = scene.nearest_pair(arm, positions[row].tolist())
    if pair is None:
        return ()
    least = f"least clearance {1e3 * pair.distance:z.1f} mm at {times[row]:.2f} s"
    return (f"{least} ({pair.link} to {pair.other})",)
