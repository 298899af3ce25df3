"""An arm that another process owns, with the interface of ``Robot``.

Begin with ``remote_robot``, which ``Robot.connect("arm:NAME")`` returns. ``link`` has its requests
and answers, and connects again; ``transport`` is the interface of the way to an owner, by
``owner_socket`` on this computer, or by ``gateway`` and its ``websocket`` on another one.
``lease_keeper`` renews the lease, ``remote_operation`` is the handle of a motion and
``remote_controllers`` are the controllers that clients load. Nothing here knows a bus or a joint.
"""

from bioscara.remote.gateway import GatewayAddress as GatewayAddress
from bioscara.remote.owner_socket import OwnerSocket as OwnerSocket
from bioscara.remote.remote_controllers import RemoteControllers as RemoteControllers
from bioscara.remote.remote_robot import RemoteRobot as RemoteRobot
