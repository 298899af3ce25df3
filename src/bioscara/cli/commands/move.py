"""``bioscara move``."""

from __future__ import annotations

import math
from collections import deque

from bioscara.cli.arguments import Options
from bioscara.cli.arm import (
    NewWarnings,
    acknowledge_faults,
    open_arm,
    remedy,
    require_acknowledgement,
)
from bioscara.cli.output.console import ExitStatus, Output, complain
from bioscara.cli.output.plots import require_files, write_picture, write_trajectory
from bioscara.cli.parameters import parameters_from
from bioscara.cli.signals import StopRequest
from bioscara.cli.target import describe, plan_target, target_planner
from bioscara.errors import BioscaraError, InvalidArgumentError, MotionCancelledError
from bioscara.report import CycleRecord
from bioscara.robot import Robot


def run(options: Options) -> int:
    """Home the arm where necessary, move it to a target and release it.

    Raises:
        BioscaraError: The motion was refused or failed before anything moved.
        OSError: Standard output cannot be written.
    """
    require_files(options)
    parameters, output = parameters_from(options), Output()
    wanted = target_planner(options, parameters)
    robot = open_arm(options, parameters)
    robot.table, robot.scene = wanted.workspace.table, wanted.workspace.scene
    robot.tool = options.tool
    with StopRequest() as cancelled, robot:
        output.line(f"arm: {robot.description}")
        require_acknowledgement(robot, options)
        acknowledge_faults(robot, output.line)
        output.line("homing the joints that are not homed")
        warnings = NewWarnings(robot)
        try:
            status = _move(robot, options, cancelled, output)
        finally:
            for sentence in warnings.take():
                output.line(sentence)
        if status is not ExitStatus.OK:
            return status
        x, y, z, yaw = robot.pose
        output.line(f"tool at ({x:z.4f}, {y:z.4f}, {z:z.4f}) m, yaw {math.degrees(yaw):z.1f} deg")
    output.check()
    return ExitStatus.OK


def _move(robot: Robot, options: Options, cancelled: StopRequest, output: Output) -> ExitStatus:
    """Home the arm and move it; print the error that stopped it.

    Raises:
        InvalidArgumentError: The motion was refused before anything moved.
    """
    cycles: deque[CycleRecord] = deque(maxlen=1)

    def on_cycle(record: CycleRecord) -> None:
        cycles.append(record)
        if cancelled():
            robot.stop()

    try:
        robot.home(on_cycle=on_cycle)
        plan = plan_target(robot.plan, options)
        for line in describe(plan, robot.kinematics):
            output.line(line)
        if options.csv is not None:
            output.line(write_trajectory(options.csv, plan.trajectory))
        if options.plot is not None:
            picture = write_picture(options.plot, plan, robot.plan, robot.parameters, "move")
            output.line(picture)
        robot.execute(plan, on_cycle=on_cycle)
    except MotionCancelledError as error:
        complain(f"{error}; all joints were stopped and disabled")
        return ExitStatus.INTERRUPTED
    except BioscaraError as error:
        # No cycle of a motion was recorded: nothing has moved.
        if isinstance(error, InvalidArgumentError) and not cycles:
            raise
        cause = robot.faults[0] if robot.faults else error
        complain(f"{cause}{remedy(robot)}; all joints were stopped and disabled")
        return ExitStatus.FAILED
    return ExitStatus.OK
