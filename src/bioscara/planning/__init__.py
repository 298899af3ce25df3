"""Planning as pure mathematics: limits and goals go in, timed joint motions come out.

Begin with ``motions``, what a user asks for, and ``trajectory``, the one type that everything above
executes. Between them a tool path from ``paths`` gets its timing in ``topp``, a joint motion its
from ``profiles``. ``collision`` keeps all of them clear of what is around, ``files`` stores them.
``limits`` and ``tool_limits`` are what joints and tool can do; ``moving_average`` keeps streamed
values from making belts swing.

A trajectory that ``trajectory.validation`` accepts stays within every limit at every instant.
"""

from bioscara.planning.files.trajectory_file import TrajectoryFile as TrajectoryFile
from bioscara.planning.files.trajectory_file import read as read
from bioscara.planning.files.trajectory_file import write_csv as write_csv
from bioscara.planning.limits import JointLimits as JointLimits
from bioscara.planning.motions.cartesian import circular as circular
from bioscara.planning.motions.cartesian import linear as linear
from bioscara.planning.motions.point_to_point import point_to_point as point_to_point
from bioscara.planning.motions.point_to_point import state_to_state as state_to_state
from bioscara.planning.motions.sequence import Sequenced as Sequenced
from bioscara.planning.motions.sequence import sequence as sequence
from bioscara.planning.motions.waypoints import Motion as Motion
from bioscara.planning.motions.waypoints import Waypoint as Waypoint
from bioscara.planning.motions.waypoints import approach as approach
from bioscara.planning.motions.waypoints import retract as retract
from bioscara.planning.tool_limits import ToolLimits as ToolLimits
from bioscara.planning.topp.topp import parameterise as parameterise
from bioscara.planning.trajectory.retiming import fit as fit
from bioscara.planning.trajectory.trajectory import Sample as Sample
from bioscara.planning.trajectory.trajectory import Trajectory as Trajectory
from bioscara.planning.trajectory.validation import check as check
