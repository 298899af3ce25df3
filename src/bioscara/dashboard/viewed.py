"""The page without an owner: a motion, an arm that moves now, or joints with sliders."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from bioscara.api.messages import TrajectoryValue, WorkspaceState
from bioscara.model import ArmParameters


class Viewed(msgspec.Struct, frozen=True):
    """An arm, and the content of its page.

    Attributes:
        title: Its title.
        parameters: Parameters of the arm.
        workspace: Its tool, scene and load.
        positions: Where the arm is shown at first, and joints that the motion does not name: j1 to
            j4 [rad, m, rad, rad].
        notes: Sentences on it for the person.
        motion: The motion to play, or null; times before 0 are those before a trajectory.
        phases: Begin of each part of the motion [s], and its name; empty for a pause.
        live: Whether the arm moves now, and is asked for its positions; without this and a motion
            the page has a slider for each joint.
    """

    title: str
    parameters: ArmParameters
    workspace: WorkspaceState
    positions: tuple[float, ...]
    notes: tuple[str, ...] = ()
    motion: TrajectoryValue | None = None
    phases: tuple[tuple[float, str], ...] = ()
    live: bool = False


class ViewedNow(msgspec.Struct, frozen=True):
    """An arm that moves, now.

    Attributes:
        time: Its time [s].
        positions: j1 to j4 [rad, m, rad, rad]; empty if they are unknown.
        problem: Why they are unknown; empty if they are known.
    """

    time: float
    positions: Sequence[float]
    problem: str = ""
