"""``bioscara ros``."""

from __future__ import annotations

from contextlib import ExitStack
from importlib.util import find_spec
from pathlib import Path

from bioscara.api.runtime import DEFAULT
from bioscara.cli.commands.serving.owners import owner_name
from bioscara.cli.options import Options
from bioscara.cli.output.console import ExitStatus
from bioscara.cli.signals import StopRequest
from bioscara.errors import ConfigurationError
from bioscara.model.urdf import URDF
from bioscara.ros import owner_process
from bioscara.ros.owner_process import OwnerProcess, require_free

_BRINGUP = Path(owner_process.__file__).with_name("bringup.yaml")
"""Parameters of the manager and its controllers, where no argument of ROS is given."""

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
)


def own_description() -> str:
    """Return the description of a node that is given none.

    The robot has the name that it has in the packages of ROS: MoveIt compares it with that of its
    semantic description.
    """
    return URDF.read_text().replace('<robot name="bioscara">', '<robot name="scene">', 1)


def run(options: Options) -> int:
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
    arm = (options.arm or DEFAULT) if options.bus else owner_name(options)
    if options.bus:
        require_free(arm)
    # Imported here: they need rclpy.
    from bioscara.ros.node import ControllerManagerNode  # noqa: PLC0415

    # Handled first: launch repeats Ctrl-C, and the second one must not interrupt the end.
    with StopRequest() as cancelled, ExitStack() as owner:
        arguments, description = options.ros_arguments, ""
        if not arguments:
            arguments = ["--ros-args", "--params-file", str(_BRINGUP)]
            description = own_description()
        node = ControllerManagerNode(arm, arguments, description)
        process = None
        if options.bus:
            rate = node.parameter("update_rate")
            process = owner.enter_context(OwnerProcess(options.bus, arm, rate, homed=options.homed))
        node.run(cancelled, process)
    return ExitStatus.OK
