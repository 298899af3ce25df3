"""The arm's joints: lengths between them, their ranges and their positions."""

from __future__ import annotations

from typing import NamedTuple, Protocol


class PositionLimits(Protocol):
    """Limits of one joint; :class:`bioscara.model.JointParameters` is one."""

    @property
    def name(self) -> str:
        """Name of the joint."""
        ...

    @property
    def unit(self) -> str:
        """``"rad"`` or ``"m"``."""
        ...

    @property
    def lower(self) -> float:
        """Lowest position [unit]."""
        ...

    @property
    def upper(self) -> float:
        """Highest position [unit]."""
        ...


class Geometry(NamedTuple):
    """Lengths of the arm, from the robot description.

    Attributes:
        upper_arm: From the column's axis to the elbow's, L1 [m].
        forearm: From the elbow's axis to the wrist's, L2 [m].
        height: Of the flange above the base when j2 is 0 [m].
    """

    upper_arm: float
    forearm: float
    height: float


class Joints(NamedTuple):
    """Positions of the four joints.

    Attributes:
        j1: Column [rad].
        j2: Lift [m].
        j3: Elbow [rad].
        j4: Wrist [rad].
    """

    j1: float
    j2: float
    j3: float
    j4: float
