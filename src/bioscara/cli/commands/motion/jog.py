"""``bioscara jog``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from bioscara.cli.arm_choice import share_arm
from bioscara.cli.output.console import ExitStatus, Output
from bioscara.cli.parser import Options, Parser
from bioscara.cli.shared_arguments import share, share_scene
from bioscara.errors import InvalidArgumentError

if TYPE_CHECKING:
    from bioscara.cli.motion import Progress
    from bioscara.cli.terminal.jog_keys import JogKeys
    from bioscara.cli.terminal.keyboard import Keyboard
    from bioscara.planning.motions.jog import JointVelocity, ToolVelocity
    from bioscara.report import CycleRecord
    from bioscara.robot.arm_methods import ArmMethods

_STEP_SCALING = 0.3
"""Share of the limits with which a step is made."""


def arguments(parser: Parser) -> None:
    share(parser, "--parameters")
    share_scene(parser)
    share(parser, "--table", "--tool")
    share_arm(parser)
    share(parser, "--acknowledge", "--realtime", "--full-speed", "--deg", "--rate", "--priority")


def run(options: Options, output: Output) -> ExitStatus:
    """Home the arm where necessary and move it by keys until ``q``; then release it.

    Raises:
        InvalidArgumentError: Standard input is no terminal, or an option is wrong.
    """
    from bioscara.cli.arm_parameters import parameters_from
    from bioscara.cli.motion import carry_out, limitation_line, opened_arm, show_position, tool_line
    from bioscara.cli.opened_arm import arrange
    from bioscara.cli.output.angles import angle_unit
    from bioscara.cli.target import scene_from
    from bioscara.cli.teach_table import lookup, read_table
    from bioscara.cli.terminal.jog_keys import JogKeys
    from bioscara.cli.terminal.keyboard import Keyboard
    from bioscara.robot.workspace.tools import fingers

    parameters = parameters_from(options)
    table, scene = read_table(options, fingers(parameters)), scene_from(options)
    tool = lookup(options, table.tool, options.tool)
    keys = JogKeys(parameters.joints)
    with Keyboard() as keyboard, opened_arm(options, parameters, output) as (robot, cancelled):
        arrange(robot, options, table, scene, tool.name)
        pose = tool_line(robot, angle_unit(options))

        def caption(record: CycleRecord) -> Sequence[str]:
            return [*pose(record), *limitation_line(robot), *keys.lines()]

        def motion(progress: Progress) -> None:
            progress.phase("homing the joints that are not homed")
            robot.home(on_cycle=progress.cycle)
            keyboard.read()  # Keys that were pressed during homing do not count.
            _jog(robot, keyboard, keys, progress)

        status = carry_out(robot, cancelled, options, output, motion, caption)
        if status is ExitStatus.OK:
            show_position(robot, options, output)
    return status


def _jog(robot: ArmMethods, keyboard: Keyboard, keys: JogKeys, progress: Progress) -> None:
    """Jog until ``q`` or the end of the terminal; steps are planned motions in between."""
    from bioscara.kinematics import Pose

    def velocity() -> JointVelocity | ToolVelocity | None:
        now = robot.state.time
        for key in keyboard.read():
            if not progress.press(key):
                keys.press(key, now)
        if keys.ended or keyboard.closed or keys.step is not None:
            return None
        return keys.velocity(now)

    def during_step(record: CycleRecord) -> None:
        progress.cycle(record)
        # Others do not count.
        keys.ended |= "q" in [key for key in keyboard.read() if not progress.press(key)]

    while True:
        robot.jog(velocity, on_cycle=progress.cycle)
        if keys.ended or keyboard.closed or keys.step is None:
            return
        by = keys.step.by
        try:
            if isinstance(by, Pose):
                robot.move_relative(*by, velocity_scaling=_STEP_SCALING, on_cycle=during_step)
            else:
                goal = [here + step for here, step in zip(robot.state.positions, by, strict=True)]
                robot.move_joints(goal, velocity_scaling=_STEP_SCALING, on_cycle=during_step)
        except InvalidArgumentError as error:
            progress.note(f"warning: not moved: {error}")
        if keys.ended:
            return
        keys.step = None
