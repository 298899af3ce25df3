"""Trajectories, pure mathematics: limits and goals go in, timed joint motions come out.

``trajectory`` is the one type that everything above executes; ``files`` reads and writes it;
``check`` tells whether an arm with given limits can do it, on the curve between the points;
``fit`` stretches it in time until it can; ``ramp`` brings an arm to its start, or to rest.
``zones`` tells whether the arm keeps clear of all around it on the way; ``jog`` moves it by
streamed velocities under the same rule.

Law: what ``check`` accepts stays within every limit at every instant.
"""

from bioscara.planning.check import check as check
from bioscara.planning.files import TrajectoryFile as TrajectoryFile
from bioscara.planning.files import read as read
from bioscara.planning.files import write_csv as write_csv
from bioscara.planning.fit import fit as fit
from bioscara.planning.limits import JointLimits as JointLimits
from bioscara.planning.ramp import ramp as ramp
from bioscara.planning.ramp import stop_ramp as stop_ramp
from bioscara.planning.trajectory import Sample as Sample
from bioscara.planning.trajectory import Trajectory as Trajectory
