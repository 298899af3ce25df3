"""Trajectories, pure mathematics: limits and goals go in, timed joint motions come out.

``trajectory`` is the one type that everything above executes; ``files`` reads and writes it;
``check`` tells whether an arm with given limits can do it, on the curve between the points;
``fit`` stretches it in time until it can; ``point_to_point`` brings an arm from place to place, and
``state_to_state`` also in motion; ``cartesian`` leads the tool on lines and arcs,
``parameterisation`` on any ``path``, and ``sequence`` through ``waypoints``. ``zones`` tells
whether the arm keeps clear of all around it on the way; ``jog`` moves it by streamed velocities
under the same rule.

Below these, for one joint: ``limits``, ``double_s``, ``profile`` and ``longest_ways``; ``extrema``
of a trajectory. For a path: ``curve``, ``joint_path``, ``path_limits``, ``tool_limits``,
``phase_plane``, ``stretched_ends``, ``path_refusals`` and the ``blending`` of corners;
``tool_speed`` for trajectories of any kind. Against the swing of belts: ``smoothing`` of streamed
values, ``averaging`` of trajectories. For what is around: ``scene_file`` and ``zone_values``,
``bodies``, their ``shapes`` and a ``table`` of these, what of an arm is ``meeting``, ``layout`` for
one arm and what of it is ``nearby``, ``sweep`` of a trajectory, ``standing``, ``stopping`` and
``room`` of an arm in motion, ``unfolding`` of an arm that is near to itself. For files:
``ros_yaml``, ``message_text`` and ``numbers``.

Law: what ``check`` accepts stays within every limit at every instant.
"""

from bioscara.planning.cartesian import circular as circular
from bioscara.planning.cartesian import linear as linear
from bioscara.planning.check import check as check
from bioscara.planning.files import TrajectoryFile as TrajectoryFile
from bioscara.planning.files import read as read
from bioscara.planning.files import write_csv as write_csv
from bioscara.planning.fit import fit as fit
from bioscara.planning.limits import JointLimits as JointLimits
from bioscara.planning.parameterisation import parameterise as parameterise
from bioscara.planning.point_to_point import point_to_point as point_to_point
from bioscara.planning.point_to_point import state_to_state as state_to_state
from bioscara.planning.sequence import Sequenced as Sequenced
from bioscara.planning.sequence import sequence as sequence
from bioscara.planning.tool_limits import ToolLimits as ToolLimits
from bioscara.planning.trajectory import Sample as Sample
from bioscara.planning.trajectory import Trajectory as Trajectory
from bioscara.planning.waypoints import Motion as Motion
from bioscara.planning.waypoints import Waypoint as Waypoint
from bioscara.planning.waypoints import approach as approach
from bioscara.planning.waypoints import retract as retract
