"""Bioscara: the software of a four-axis SCARA lab arm, from the wire to ROS 2.

Begin with ``Robot``: ``from bioscara import Robot, Pose``. The names of programs that move the arm
are here; each is imported when it is first used, so that ``import bioscara`` stays fast.
"""

from __future__ import annotations

from bioscara.version import __version__ as __version__

TYPE_CHECKING = False  # as in typing, whose import would take longer than that of this module
if TYPE_CHECKING:
    from bioscara.connect import Robot as Robot
    from bioscara.errors import BioscaraError as BioscaraError
    from bioscara.errors import BusyError as BusyError
    from bioscara.errors import FaultedError as FaultedError
    from bioscara.errors import GoalAbortedError as GoalAbortedError
    from bioscara.errors import GripperError as GripperError
    from bioscara.errors import HardwareError as HardwareError
    from bioscara.errors import HomingError as HomingError
    from bioscara.errors import InvalidArgumentError as InvalidArgumentError
    from bioscara.errors import LeaseError as LeaseError
    from bioscara.errors import LifecycleError as LifecycleError
    from bioscara.errors import MotionCancelledError as MotionCancelledError
    from bioscara.errors import MotionTimeoutError as MotionTimeoutError
    from bioscara.errors import NotHomedError as NotHomedError
    from bioscara.errors import NotInitializedError as NotInitializedError
    from bioscara.errors import NotSupportedError as NotSupportedError
    from bioscara.errors import OwnerLostError as OwnerLostError
    from bioscara.errors import TrajectoryError as TrajectoryError
    from bioscara.errors import UnreachableError as UnreachableError
    from bioscara.errors import ZoneError as ZoneError
    from bioscara.kinematics import Joints as Joints
    from bioscara.kinematics import Pose as Pose
    from bioscara.model import ArmParameters as ArmParameters
    from bioscara.model import load_parameters as load_parameters
    from bioscara.planning import Motion as Motion
    from bioscara.planning import Trajectory as Trajectory
    from bioscara.planning import Waypoint as Waypoint
    from bioscara.planning import approach as approach
    from bioscara.planning import retract as retract
    from bioscara.planning.collision.scene import Box as Box
    from bioscara.planning.collision.scene import Cylinder as Cylinder
    from bioscara.planning.collision.scene import Scene as Scene
    from bioscara.planning.collision.shapes import Prism as Prism
    from bioscara.planning.files.scene_file import read_scene as read_scene
    from bioscara.planning.motions.jog import JointVelocity as JointVelocity
    from bioscara.planning.motions.jog import ToolVelocity as ToolVelocity
    from bioscara.planning.motions.jog_limitation import JogLimit as JogLimit
    from bioscara.planning.motions.jog_limitation import JogLimitation as JogLimitation
    from bioscara.remote import RemoteRobot as RemoteRobot
    from bioscara.report.recording import Recording as Recording
    from bioscara.robot.operations.operation import Operation as Operation
    from bioscara.robot.operations.running import Running as Running
    from bioscara.robot.operations.running import Status as Status
    from bioscara.robot.planner import Plan as Plan
    from bioscara.robot.planner import Planner as Planner
    from bioscara.robot.sequences.running import run_sequence as run_sequence
    from bioscara.robot.sequences.sequence_file import read_sequence as read_sequence
    from bioscara.robot.sequences.steps import StepSequence as StepSequence
    from bioscara.robot.workspace.frames import Frame as Frame
    from bioscara.robot.workspace.grids import Grid as Grid
    from bioscara.robot.workspace.load import Load as Load
    from bioscara.robot.workspace.poses import NamedPose as NamedPose
    from bioscara.robot.workspace.poses import TeachTable as TeachTable
    from bioscara.robot.workspace.teach_file import load_table as load_table
    from bioscara.robot.workspace.teach_file import save_table as save_table
    from bioscara.robot.workspace.tools import Tool as Tool
    from bioscara.robot.workspace.workspace import Workspace as Workspace
    from bioscara.units import deg as deg
    from bioscara.units import mm as mm

_MODULES = {
    "bioscara.connect": ("Robot",),
    "bioscara.errors": (
        "BioscaraError",
        "BusyError",
        "FaultedError",
        "GoalAbortedError",
        "GripperError",
        "HardwareError",
        "HomingError",
        "InvalidArgumentError",
        "LeaseError",
        "LifecycleError",
        "MotionCancelledError",
        "MotionTimeoutError",
        "NotHomedError",
        "NotInitializedError",
        "NotSupportedError",
        "OwnerLostError",
        "TrajectoryError",
        "UnreachableError",
        "ZoneError",
    ),
    "bioscara.kinematics": (
        "Joints",
        "Pose",
    ),
    "bioscara.model": (
        "ArmParameters",
        "load_parameters",
    ),
    "bioscara.planning": (
        "Motion",
        "Trajectory",
        "Waypoint",
        "approach",
        "retract",
    ),
    "bioscara.planning.collision.scene": (
        "Box",
        "Cylinder",
        "Scene",
    ),
    "bioscara.planning.collision.shapes": ("Prism",),
    "bioscara.planning.files.scene_file": ("read_scene",),
    "bioscara.planning.motions.jog": (
        "JointVelocity",
        "ToolVelocity",
    ),
    "bioscara.planning.motions.jog_limitation": (
        "JogLimit",
        "JogLimitation",
    ),
    "bioscara.remote": ("RemoteRobot",),
    "bioscara.report.recording": ("Recording",),
    "bioscara.robot.operations.operation": ("Operation",),
    "bioscara.robot.operations.running": (
        "Running",
        "Status",
    ),
    "bioscara.robot.planner": (
        "Plan",
        "Planner",
    ),
    "bioscara.robot.sequences.running": ("run_sequence",),
    "bioscara.robot.sequences.sequence_file": ("read_sequence",),
    "bioscara.robot.sequences.steps": ("StepSequence",),
    "bioscara.robot.workspace.frames": ("Frame",),
    "bioscara.robot.workspace.grids": ("Grid",),
    "bioscara.robot.workspace.load": ("Load",),
    "bioscara.robot.workspace.poses": (
        "NamedPose",
        "TeachTable",
    ),
    "bioscara.robot.workspace.teach_file": (
        "load_table",
        "save_table",
    ),
    "bioscara.robot.workspace.tools": ("Tool",),
    "bioscara.robot.workspace.workspace": ("Workspace",),
    "bioscara.units": ("deg", "mm"),
}
_HOMES = {name: module for module, names in _MODULES.items() for name in names}

__all__ = [
    "__version__",
    "ArmParameters",
    "BioscaraError",
    "Box",
    "BusyError",
    "Cylinder",
    "FaultedError",
    "Frame",
    "GoalAbortedError",
    "Grid",
    "GripperError",
    "HardwareError",
    "HomingError",
    "InvalidArgumentError",
    "JogLimit",
    "JogLimitation",
    "JointVelocity",
    "Joints",
    "LeaseError",
    "LifecycleError",
    "Load",
    "Motion",
    "MotionCancelledError",
    "MotionTimeoutError",
    "NamedPose",
    "NotHomedError",
    "NotInitializedError",
    "NotSupportedError",
    "Operation",
    "OwnerLostError",
    "Plan",
    "Planner",
    "Pose",
    "Prism",
    "Recording",
    "RemoteRobot",
    "Robot",
    "Running",
    "Scene",
    "Status",
    "StepSequence",
    "TeachTable",
    "Tool",
    "ToolVelocity",
    "Trajectory",
    "TrajectoryError",
    "UnreachableError",
    "Waypoint",
    "Workspace",
    "ZoneError",
    "approach",
    "deg",
    "load_parameters",
    "load_table",
    "mm",
    "read_scene",
    "read_sequence",
    "retract",
    "run_sequence",
    "save_table",
]


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module  # noqa: PLC0415  slower than this module

    value = globals()[name] = getattr(import_module(_HOMES[name]), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
