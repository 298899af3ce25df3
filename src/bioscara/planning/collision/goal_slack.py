"""Clearance slack allowed at a goal position."""

from __future__ import annotations

STAND = 0.9e-3
"""How much nearer to a body the arm may stand than commanded [m]: 1 mrad at its reach."""


def goal_slack(margin: float) -> float:
    """Return the slack of a margin at a goal position [m].

    Args:
        margin: Distance to keep [m].
    """
    return min(STAND, margin / 2.0)
