"""The names of programs that move the arm; each is imported when it is first used."""

from bioscara.connect import Robot as Robot
from bioscara.errors import (
    BioscaraError as BioscaraError,
    BusyError as BusyError,
    FaultedError as FaultedError,
    GoalAbortedError as GoalAbortedError,
    GripperError as GripperError,
    HardwareError as HardwareError,
    HomingError as HomingError,
    InvalidArgumentError as InvalidArgumentError,
    LeaseError as LeaseError,
    LifecycleError as LifecycleError,
    MotionCancelledError as MotionCancelledError,
    MotionTimeoutError as MotionTimeoutError,
    NotHomedError as NotHomedError,
    NotInitializedError as NotInitializedError,
    NotSupportedError as NotSupportedError,
    OwnerLostError as OwnerLostError,
    TrajectoryError as TrajectoryError,
    UnreachableError as UnreachableError,
    ZoneError as ZoneError,
)
from bioscara.kinematics import Joints as Joints, Pose as Pose
from bioscara.model import ArmParameters as ArmParameters, load_parameters as load_parameters
from bioscara.planning import (
    Motion as Motion,
    Trajectory as Trajectory,
    Waypoint as Waypoint,
    approach as approach,
    retract as retract,
)
from bioscara.planning.collision.scene import Box as Box, Cylinder as Cylinder, Scene as Scene
from bioscara.planning.collision.shapes import Prism as Prism
from bioscara.planning.files.scene_file import read_scene as read_scene
from bioscara.planning.motions.jog import (
    JointVelocity as JointVelocity,
    ToolVelocity as ToolVelocity,
)
from bioscara.planning.motions.jog_limitation import (
    JogLimit as JogLimit,
    JogLimitation as JogLimitation,
)
from bioscara.remote import RemoteRobot as RemoteRobot
from bioscara.report.samples import Samples as Samples
from bioscara.robot.arm_methods import ArmMethods as ArmMethods
from bioscara.robot.operations.operation import Operation as Operation
from bioscara.robot.operations.running import Running as Running, Status as Status
from bioscara.robot.planner import Plan as Plan, Planner as Planner
from bioscara.robot.sequences.running import run_sequence as run_sequence
from bioscara.robot.sequences.sequence_file import read_sequence as read_sequence
from bioscara.robot.sequences.steps import StepSequence as StepSequence
from bioscara.robot.workspace.frames import Frame as Frame
from bioscara.robot.workspace.grids import Grid as Grid
from bioscara.robot.workspace.load import Load as Load
from bioscara.robot.workspace.poses import NamedPose as NamedPose, TeachTable as TeachTable
from bioscara.robot.workspace.teach_file import load_table as load_table, save_table as save_table
from bioscara.robot.workspace.tools import Tool as Tool
from bioscara.robot.workspace.workspace import Workspace as Workspace
from bioscara.units import deg as deg, mm as mm
from bioscara.version import __version__ as __version__
