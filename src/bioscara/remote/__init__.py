"""An arm that another process owns, with the interface of ``Robot``.

Begin with ``remote_robot``, which ``Robot.connect("arm:NAME")`` returns. ``link`` is its
connection, ``lease_keeper`` renews the lease, ``remote_operation`` is the handle of a motion
and ``remote_controllers`` are the controllers that clients load. Nothing here knows a bus or a
joint.
"""

from bioscara.remote.remote_controllers import RemoteControllers as RemoteControllers
from bioscara.remote.remote_robot import RemoteRobot as RemoteRobot
