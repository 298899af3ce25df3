"""``bioscara ros``."""

from __future__ import annotations

import os
import sys
from contextlib import ExitStack
from importlib.util import find_spec
from pathlib import Path

from bioscara.api.runtime import DEFAULT
from bioscara.cli.output.console import Output
from bioscara.cli.parser import Options, Parser
from bioscara.cli.shared_arguments import share
from bioscara.errors import ConfigurationError

_NEEDED = (
    "rclpy",
    "control_msgs",
    "controller_manager_msgs",
    "diagnostic_msgs",
    "pal_statistics_msgs",
    "sensor_msgs",
    "std_srvs",
    "tf2_msgs",
    "trajectory_msgs",
    "visualization_msgs",
)


def arguments(parser: Parser) -> None:
    parser.leave("ros_arguments", "--ros-args", "--")
    share(parser, "--arm")
    parser.add_argument(
        "--bus",
        metavar="BUS",
        default="",
        help="own the arm on this bus, 'sim' (simulated) or 'linux:1' (I2C bus 1), instead of "
        "using that of another owner; it is named as --arm says, else 'arm'",
    )
    share(parser, "--homed")
    share(
        parser,
        "--camera",
        help="publish images of the simulated world of the owner, four a second: front, side, top "
        "or wrist, with 640x480 pixels if no size is given",
    )
    parser.checks.append(_check_arm)


def _check_arm(parser: Parser, options: Options) -> None:
    if options.bus and options.arm:
        parser.error("--arm and --bus exclude one another; leave out one of them")


def own_description() -> str:
    """Return the description of a node that is given none.

    The robot has the name that it has in the packages of ROS: MoveIt compares it with that of its
    semantic description.
    """
    from bioscara.model.urdf import URDF

    return URDF.read_text().replace('<robot name="bioscara">', '<robot name="scene">', 1)


def run(options: Options, output: Output) -> None:  # noqa: ARG001
    """Run the node of ROS 2 until Ctrl-C.

    Raises:
        ConfigurationError: A package is missing, or the robot description cannot be used.
        BioscaraError: No arm is named, or its owner has ended; or there is one already, where this
            program is to own the arm.
    """
    missing = [name for name in _NEEDED if find_spec(name) is None]
    if missing:
        raise ConfigurationError(
            f"bioscara ros needs {', '.join(missing)}, not installed: with ROS 2, source its "
            "setup.bash and use an environment with --system-site-packages; without, make ros2 in "
            "the repository makes one, .venv-ros2"
        )
    from bioscara.cli.owner_link import owner_name
    from bioscara.cli.signals import StopRequest
    from bioscara.processes.child_process import Questions
    from bioscara.processes.unread_output import never_wait
    from bioscara.ros import owner_process

    if sys.stderr is not None and sys.stderr.isatty():
        # Of rcutils, which sees a pipe from here on.
        os.environ.setdefault("RCUTILS_COLORIZED_OUTPUT", "1")
    never_wait(all_of_c=True)
    Questions().answer_always()
    arm = (options.arm or DEFAULT) if options.bus else owner_name(options)
    if options.bus:
        owner_process.require_free(arm)
    from bioscara.ros.node import ControllerManagerNode  # needs rclpy

    # Handled first: launch repeats Ctrl-C, and the second one must not interrupt the end.
    with StopRequest() as cancelled, ExitStack() as owner:
        arguments, description = options.ros_arguments, ""
        if not arguments:
            bringup = Path(owner_process.__file__).with_name("bringup.yaml")
            arguments = ["--ros-args", "--params-file", str(bringup)]
            description = own_description()
        node = ControllerManagerNode(arm, arguments, description, options.camera)
        process = None
        if options.bus:
            rate = node.parameter("update_rate")
            process = owner.enter_context(
                owner_process.OwnerProcess(options.bus, arm, rate, homed=options.homed)
            )
        node.run(cancelled, process)
