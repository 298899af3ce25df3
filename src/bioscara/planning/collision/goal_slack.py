"""How near the arm may stand to something, however exactly it came to rest there."""

from __future__ import annotations

STAND = 0.9e-3
"""How much nearer to something the arm may stand than it was told to [m]: 1 mrad at its reach."""


def goal_slack(margin: float) -> float:
    """Return how much nearer than a margin the arm may stand [m].

    Args:
        margin: Distance that is to be kept [m].
    """
    return min(STAND, margin / 2.0)
