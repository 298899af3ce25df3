"""Margins that the arm keeps from bodies, and the slack of a margin at a goal position."""

from __future__ import annotations

MARGINS = (1e-3, 0.1)
"""Smallest and largest margin of a scene [m]; the error between samples is less than the
smallest."""
OWN_MARGIN = 5e-3
"""Margin between the arm's own parts where that of the scene is larger [m]: their geometry is
known, and in the folded position after homing they are 15 mm apart."""
GOAL_SLACK = 0.9e-3
"""Largest slack of a margin at a goal position [m]: 1 mrad at the arm's reach."""


def goal_slack(margin: float) -> float:
    """Return how much nearer to a body than the margin the arm may rest at a goal [m].

    Args:
        margin: Distance to keep [m].
    """
    return min(GOAL_SLACK, margin / 2.0)
