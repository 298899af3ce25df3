"""The numbers that hardware and controllers share, one handle each."""

from __future__ import annotations

import math

from bioscara.drivers import Quality as Quality
from bioscara.errors import BioscaraError

POSITION, VELOCITY, HOME = "position", "velocity", "home"


class Interface:
    """A number of one joint.

    Args:
        joint: Name of the joint.
        kind: ``"position"``, ``"velocity"`` or ``"home"``.

    Attributes:
        joint: As given.
        kind: As given.
        name: ``"<joint>/<kind>"``.
        value: The number, SI units; NaN while there is none.
    """

    __slots__ = ("joint", "kind", "name", "value")

    def __init__(self, joint: str, kind: str) -> None:
        self.joint, self.kind = joint, kind
        self.name = f"{joint}/{kind}"
        self.value = math.nan


class StateInterface(Interface):
    """A measured number: written by the hardware in ``read``, read by everybody.

    Attributes:
        quality: How far it can be believed.
        stamp: When it was measured [s], on the clock of the hardware.
    """

    __slots__ = ("quality", "stamp")

    def __init__(self, joint: str, kind: str) -> None:
        super().__init__(joint, kind)
        self.quality = Quality.UNKNOWN
        self.stamp = -math.inf

    def __repr__(self) -> str:
        return f"<{self.name} {self.value:g} {self.quality.value}>"

    def forget(self) -> None:
        """Know nothing any more."""
        self.value, self.quality, self.stamp = math.nan, Quality.UNKNOWN, -math.inf


class CommandInterface(Interface):
    """A commanded number: written by the one controller that claimed it.

    Attributes:
        owner: Name of the controller that claimed it, or None.
        problem: Why the hardware gave the last command up; None while it did not. Whoever gives a
            command clears it.
    """

    __slots__ = ("owner", "problem")

    def __init__(self, joint: str, kind: str) -> None:
        super().__init__(joint, kind)
        self.owner: str | None = None
        self.problem: BioscaraError | None = None

    def __repr__(self) -> str:
        return f"<{self.name} {self.value:g} of {self.owner or 'nobody'}>"
