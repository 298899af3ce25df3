"""What ``bioscara view`` shows: a run, a recording, a trajectory, a plan, or a running arm."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

from bioscara.cli.parser import Options
from bioscara.cli.shared_arguments import START
from bioscara.cli.target import plan_target, target_planner
from bioscara.errors import (
    BioscaraError,
    BusUnavailableError,
    ConfigurationError,
    InvalidArgumentError,
)
from bioscara.kinematics import Scara
from bioscara.model import ArmParameters
from bioscara.planning import Trajectory, check, read
from bioscara.planning.collision.scene import Scene
from bioscara.remote import RemoteRobot
from bioscara.report.folder import SAMPLES
from bioscara.report.recorded import read_run
from bioscara.sim import Onlooker
from bioscara.viewer.played_motion import PlayedMotion

_SIMULATED, _SERVED = "sim:", "arm:"


def is_arm(source: str) -> bool:
    """Return whether SOURCE names an arm, and not a file or folder."""
    return source == "sim" or source.startswith((_SIMULATED, _SERVED, "linux:"))


def look_at(source: str) -> Callable[[], tuple[float, Sequence[float]]]:
    """Return a function that returns the time and the joint positions of a running arm.

    Args:
        source: Name of the bus of a simulated one, or ``arm:NAME`` for one that is served.

    Raises:
        InvalidArgumentError: The arm cannot be shown.
        BusUnavailableError: No arm answers behind the socket.
        OwnerLostError: No owner of that name runs.
    """
    if source.startswith(_SERVED):
        return _look_at_served(source.removeprefix(_SERVED))
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
    return onlooker.look


def _look_at_served(name: str) -> Callable[[], tuple[float, Sequence[float]]]:
    robot = RemoteRobot(name).open()

    def look() -> tuple[float, Sequence[float]]:
        try:
            state = robot.state
        except BioscaraError as error:
            # The owner may restart, and the joints may be enabled or recovered.
            raise BusUnavailableError(str(error)) from error
        if any(map(math.isnan, state.positions)):
            raise BusUnavailableError(f"arm {name} is not homed: its position is unknown")
        return state.time, state.positions

    return look


def recording_from(
    options: Options, parameters: ArmParameters, scene: Scene, arm: Scara
) -> PlayedMotion:
    """Return the motion in the run folder, recording or trajectory file that SOURCE names.

    Args:
        options: Parsed options.
        parameters: Parameters of the arm.
        scene: Surroundings of the arm.
        arm: The arm with its tool.

    Raises:
        ConfigurationError: The folder is not that of a run, or its samples cannot be read.
        RecordingError: The recording cannot be read.
        TrajectoryError: The file cannot be read or holds no trajectory.
    """
    path = Path(options.source or "")
    if path.name == SAMPLES and path.is_file():
        raise InvalidArgumentError(
            f"{path} are the samples of a run; name its folder: bioscara view {path.parent}"
        )
    if path.is_dir():
        return _run(path, [limit.name for limit in arm.limits])
    if path.suffix == ".mcap":
        return _recorded(path, [limit.name for limit in arm.limits])
    trajectory, notes = read(path)
    return of_trajectory(str(path), trajectory, notes, parameters, scene, arm)


def plan_from(options: Options, parameters: ArmParameters) -> tuple[PlayedMotion, Scara]:
    """Return the motion to the target, as ``bioscara plan`` plans it, and the arm with its tool.

    Raises:
        BioscaraError: The motion cannot be planned.
    """
    planner = target_planner(options, parameters)
    plan = plan_target(planner, options)
    arm = planner.kinematics
    names = [limit.name for limit in arm.limits]
    recording = PlayedMotion.of_trajectory("plan", plan.trajectory, names, START, plan.notes)
    return recording, arm


def of_trajectory(
    title: str,
    trajectory: Trajectory,
    notes: tuple[str, ...],
    parameters: ArmParameters,
    scene: Scene,
    arm: Scara,
) -> PlayedMotion:
    """Return a trajectory as a recording; whether the arm can execute it is one of its notes."""
    names = [limit.name for limit in arm.limits]
    missing = [name for name in names if name not in trajectory.joint_names]
    if missing:
        notes += (f"it does not say where {', '.join(missing)} is: shown at a chosen position",)
    try:
        notes += tuple(check(trajectory, parameters.joints))
        scene.check(arm, trajectory, START)
    except BioscaraError as error:
        notes += (f"'bioscara run' refuses it: {error}",)
    return PlayedMotion.of_trajectory(title, trajectory, names, START, notes)


def _run(folder: Path, names: Sequence[str]) -> PlayedMotion:
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
    motion = read_run(folder, names)
    phases = tuple(phase.value for phase in motion.phases)
    notes = _left_out(motion.skipped)
    return PlayedMotion(f"run {folder}", motion.times, motion.positions, phases, notes)


def _recorded(path: Path, names: Sequence[str]) -> PlayedMotion:
    # Imported here: other sources do without mcap.
    from bioscara.recording.reading.joint_motion import read_motion  # noqa: PLC0415

    motion = read_motion(path, names)
    notes = _left_out(motion.skipped)
    return PlayedMotion(f"recording {path}", motion.times, motion.positions, motion.moving, notes)


def _left_out(skipped: float) -> tuple[str, ...]:
    if skipped <= 0.0:
        return ()
    return (f"the first {skipped:.1f} s, until all joints were homed, are left out",)
