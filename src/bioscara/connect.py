"""From a name to a robot: of this process, of an owner, or of one beyond a gateway.

It is above robots and their clients, which do not know of each other, and has the class that
programs begin with.
"""

from __future__ import annotations

from bioscara.errors import InvalidArgumentError
from bioscara.robot import Robot as Robot
from bioscara.robot.arm_methods import ArmMethods
from bioscara.robot.openers import OPENERS, ConnectOptions


def _owned(name: str, access: ConnectOptions) -> ArmMethods:
    # Most programs have no owner.
    from bioscara.remote import RemoteRobot  # noqa: PLC0415

    if access.of_gateway:
        raise InvalidArgumentError(
            f"{access.of_gateway[0]} is for the address of a gateway, https://HOST:PORT, and "
            f"{name} is on this computer; leave it out"
        )
    return RemoteRobot(name.removeprefix("arm:"), timeout=access.timeout)


def _beyond_gateway(name: str, access: ConnectOptions) -> ArmMethods:
    from bioscara.remote import GatewayAddress, RemoteRobot  # noqa: PLC0415

    address = GatewayAddress(
        name, access.token, ca_file=access.ca_file, fingerprint=access.fingerprint
    )
    return RemoteRobot(address, timeout=access.timeout)


OPENERS.update(arm=_owned, https=_beyond_gateway, http=_beyond_gateway)
