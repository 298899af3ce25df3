"""``bioscara move``."""

from __future__ import annotations

import math

from bioscara.cli import complain
from bioscara.cli.arguments import Options
from bioscara.cli.arm import open_arm
from bioscara.cli.interruption import Interruption
from bioscara.cli.latched import acknowledge, require_noted, the_way_on
from bioscara.cli.output import Output
from bioscara.cli.pictures import require_drawing, write_pictures
from bioscara.cli.status import Status
from bioscara.cli.target import check_target, describe, plan_target
from bioscara.cli.warned import Warnings
from bioscara.errors import BioscaraError, InvalidArgumentError, MotionCancelledError
from bioscara.model import load_parameters
from bioscara.robot.teach_file import load_table


def run(options: Options) -> int:
    """Home the arm where need be, move it to a target and release it.

    Raises:
        BioscaraError: It could not be moved there.
    """
    require_drawing(options)
    parameters, output = load_parameters(), Output()
    with Interruption() as cancelled, open_arm(options, parameters) as robot:
        if options.table.exists():
            robot.plan.table = load_table(options.table, robot.plan.tool)
        check_target(robot.plan, options)
        output.line(f"arm: {robot.description}")
        require_noted(robot, options)
        acknowledge(robot, output.line)
        output.line("homing the joints that are not homed")
        warnings = Warnings(robot)
        try:
            robot.home(cancelled=cancelled)
            plan = plan_target(robot.plan, options)
            for line in describe(plan, robot.kinematics):
                output.line(line)
            write_pictures(plan, robot.kinematics, parameters.joints, options, output)
            robot.execute(plan, cancelled=cancelled)
        except MotionCancelledError as error:
            complain(f"{error}; all joints were stopped and disabled")
            return Status.INTERRUPTED
        except InvalidArgumentError:
            raise
        except BioscaraError as error:
            told = robot.faults[0] if robot.faults else error
            complain(f"{told}{the_way_on(robot)}; all joints were stopped and disabled")
            return Status.FAILED
        finally:
            for sentence in warnings.fresh():
                output.line(sentence)
        x, y, z, yaw = robot.pose
        output.line(f"tool at ({x:.4f}, {y:.4f}, {z:.4f}) m, yaw {math.degrees(yaw):.1f} deg")
    output.check()
    return Status.OK
