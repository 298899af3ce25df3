"""Interfaces: handles of the values that hardware and controllers share."""

from __future__ import annotations

import math

from bioscara.drivers import Quality as Quality
from bioscara.errors import BioscaraError

POSITION, VELOCITY, HOME = "position", "velocity", "home"


class Interface:
    """One value of a joint.

    Args:
        joint: Name of the joint.
        kind: ``"position"``, ``"velocity"`` or ``"home"``.

    Attributes:
        joint: As given.
        kind: As given.
        name: ``"<joint>/<kind>"``.
        value: The value, SI units; NaN while there is none.
    """

    __slots__ = ("joint", "kind", "name", "value")

    def __init__(self, joint: str, kind: str) -> None:
        self.joint, self.kind = joint, kind
        self.name = f"{joint}/{kind}"
        self.value = math.nan


class StateInterface(Interface):
    """State interface: written by the hardware in ``read``, readable by all.

    Attributes:
        quality: Trustworthiness of the value.
        stamp: Time of the measurement [s], on the clock of the hardware.
    """

    __slots__ = ("quality", "stamp")

    def __init__(self, joint: str, kind: str) -> None:
        super().__init__(joint, kind)
        self.quality = Quality.UNKNOWN
        self.stamp = -math.inf

    def __repr__(self) -> str:
        return f"<{self.name} {self.value:g} {self.quality.value}>"

    def forget(self) -> None:
        """Invalidate the value."""
        self.value, self.quality, self.stamp = math.nan, Quality.UNKNOWN, -math.inf


class CommandInterface(Interface):
    """Command interface: written by the one controller that claimed it.

    Attributes:
        owner: Name of the controller that claimed it, or None.
        problem: Why the hardware abandoned the last command; None while it did not. The writer of a
            command clears it.
    """

    __slots__ = ("owner", "problem")

    def __init__(self, joint: str, kind: str) -> None:
        super().__init__(joint, kind)
        self.owner: str | None = None
        self.problem: BioscaraError | None = None

    def __repr__(self) -> str:
        return f"<{self.name} {self.value:g} {'of ' + self.owner if self.owner else 'unclaimed'}>"
