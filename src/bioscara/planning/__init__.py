"""Motion planning as pure mathematics: timed joint motions from limits and goals.

Begin with ``motions``, the user's interface, and ``trajectory``, the one type that all layers above
execute. Between them a tool path from ``paths`` gets its timing in ``topp``. ``collision`` checks
the clearance of all of them, ``files`` stores them. ``limits`` are the limits of joints and tool;
``moving_average`` keeps motions from exciting belt oscillations; ``arrays`` names the types of
arrays.

A trajectory that ``trajectory.validation`` accepts stays within every limit at every instant.
"""

from bioscara.planning.files.trajectory_file import (
    TrajectoryFile as TrajectoryFile,
    read as read,
    write_csv as write_csv,
)
from bioscara.planning.limits import JointLimits as JointLimits, ToolLimits as ToolLimits
from bioscara.planning.motions.cartesian import circular as circular, linear as linear
from bioscara.planning.motions.point_to_point import point_to_point as point_to_point
from bioscara.planning.motions.sequence import Sequenced as Sequenced, sequence as sequence
from bioscara.planning.motions.waypoints import (
    Motion as Motion,
    Waypoint as Waypoint,
    approach as approach,
    retract as retract,
)
from bioscara.planning.topp.topp import parameterise as parameterise
from bioscara.planning.trajectory.polynomials import Sample as Sample
from bioscara.planning.trajectory.retiming import fit as fit
from bioscara.planning.trajectory.trajectory import Trajectory as Trajectory
from bioscara.planning.trajectory.validation import check as check
