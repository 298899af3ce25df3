"""A motion of an arm by a command: opened, shown live, stopped by Ctrl-C, its end reported."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext

from bioscara.cli.opened_arm import (
    NewWarnings,
    acknowledge_faults,
    at_full_speed,
    introduce,
    left,
    open_arm,
    remedy,
    require_acknowledgement,
)
from bioscara.cli.output.angles import AngleUnit, angle_unit
from bioscara.cli.output.console import ExitStatus, Output, complain
from bioscara.cli.output.display import make_view
from bioscara.cli.output.live_view import Caption
from bioscara.cli.output.observer import Observer
from bioscara.cli.parser import Options
from bioscara.cli.signals import StopRequest
from bioscara.cli.terminal.keyboard import Keyboard
from bioscara.control.loop.realtime import realtime
from bioscara.errors import (
    BioscaraError,
    InvalidArgumentError,
    LeaseError,
    MotionCancelledError,
    UnconfirmedError,
)
from bioscara.kinematics import Joints
from bioscara.kinematics.pose import wrapped
from bioscara.model import ArmParameters
from bioscara.report import CycleRecord
from bioscara.robot.arm_methods import ArmMethods


class Progress:
    """Receives the cycles of the motions of a command: shows them, and stops the arm on request.

    Args:
        robot: The arm.
        observer: Shows the cycles.
        keyboard: Its keys pause the motion and continue it; None for no keys.

    Attributes:
        begun: Whether a cycle of a motion was received: the arm may have moved.
        warnings: The warnings that were shown.
    """

    def __init__(
        self,
        robot: ArmMethods,
        observer: Observer,
        keyboard: Keyboard | None = None,
    ) -> None:
        self._robot, self._observer, self._keyboard = robot, observer, keyboard
        self._new = NewWarnings(robot)
        self.begun = False
        self.warnings: list[str] = []

    def phase(self, text: str) -> None:
        """Report the begin of another phase."""
        self._observer.phase(text)

    def note(self, text: str) -> None:
        """Print a message."""
        self._observer.note(text)

    def cycle(self, record: CycleRecord) -> None:
        """Accept a cycle, as ``on_cycle`` of a motion."""
        self.begun = True
        self._observer.cycle(record)
        for key in self._keyboard.read() if self._keyboard else ():
            self.press(key)
        self.show_warnings()

    def press(self, key: str) -> bool:
        """Pause all motion by ``p``, continue by ``c``; return whether the key is one of these."""
        if key == "p":
            self._robot.pause()
            self.note("paused: c continues, Ctrl-C stops")
        elif key == "c":
            try:
                self._robot.resume()
                self.note("continues")
            except LeaseError as error:
                self.note(f"warning: {error}")
        return key in {"p", "c"}

    def show_warnings(self) -> None:
        """Show the warnings of the robot that are new."""
        for sentence in self._new.take():
            self.warnings.append(sentence)
            self._observer.note(sentence)


@contextmanager
def opened_arm(
    options: Options, parameters: ArmParameters, output: Output
) -> Iterator[tuple[ArmMethods, StopRequest]]:
    """Open the arm for motions, with ``--priority``; on leaving, it is closed.

    An arm of this process is disabled then; that of an owner stays as it is.

    Raises:
        FaultedError: A fault stopped the arm before, and is not acknowledged.
        BioscaraError: The arm cannot be used.
    """
    priority = nullcontext() if options.priority is None else realtime(options.priority)
    with StopRequest() as cancelled, priority, open_arm(options, parameters) as robot:
        introduce(robot, options, output.line)
        require_acknowledgement(robot, options)
        acknowledge_faults(robot, output.line)
        with at_full_speed(robot, options):
            yield robot, cancelled


def carry_out(
    robot: ArmMethods,
    cancelled: StopRequest,
    options: Options,
    output: Output,
    motion: Callable[[Progress], object],
    caption: Caption | None = None,
    keyboard: Keyboard | None = None,
) -> ExitStatus:
    """Call a function that moves the arm, show it live, and report the error that stopped it.

    Args:
        robot: The arm.
        cancelled: The signals that stop it.
        options: Parsed options.
        output: Output for messages to the user.
        motion: Moves the arm.
        caption: Lines to show below the table of the joints; by default the pose of the tool.
        keyboard: Its keys pause the motion and continue it; None for no keys.

    Raises:
        InvalidArgumentError, LeaseError, UnconfirmedError: The motion was refused before anything
            moved.
    """
    units = [(joint.name, joint.unit) for joint in robot.parameters.joints]
    angles = angle_unit(options)
    view = make_view(output, units, angles, caption or tool_line(robot, angles))
    progress: Progress | None = None
    try:
        with Observer(view) as observer:
            progress = Progress(robot, observer, keyboard)
            try:
                with cancelled.ending_calls_of(robot):
                    motion(progress)
            finally:
                progress.show_warnings()
    except MotionCancelledError as error:
        complain(f"{error}; {left(options)}")
        return ExitStatus.INTERRUPTED
    except BioscaraError as error:
        refused = isinstance(error, InvalidArgumentError | LeaseError | UnconfirmedError)
        if refused and not (progress and progress.begun):
            raise
        cause = robot.faults[0] if robot.faults else error
        complain(f"{cause}{remedy(robot)}; {left(options)}")
        return ExitStatus.FAILED
    return ExitStatus.OK


def tool_line(robot: ArmMethods, angles: AngleUnit) -> Caption:
    """Return a function that returns the pose of the tool as a line."""

    def line(record: CycleRecord) -> list[str]:
        pose = robot.kinematics.forward([joint.position for joint in record.joints])
        if any(map(math.isnan, pose)):
            return ["tool: unknown, as joints are not homed"]
        x, y, z = (f"{value:+z.4f}" for value in pose[:3])
        return [f"tool: {x} {y} {z} m, yaw {angles.quantity(wrapped(pose.yaw), 'rad')}"]

    return line


def limitation_line(robot: ArmMethods) -> list[str]:
    """Return a line with what slows the running jog down or holds it; none if nothing does."""
    try:
        limitation = robot.jog_limitation
    except BioscaraError:
        # The motion itself reports that the arm cannot be read.
        return []
    return [] if limitation is None else [limitation.text]


def show_position(robot: ArmMethods, options: Options, output: Output) -> None:
    """Print where the arm is, as words that ``move`` takes."""
    angles = angle_unit(options)
    output.line(angles.words(robot.pose))
    output.line(angles.words(Joints(*robot.state.positions)))
