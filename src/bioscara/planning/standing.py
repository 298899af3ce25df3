"""How near the arm may stand to something, however exactly it came to rest there."""

from __future__ import annotations

STAND = 0.9e-3
"""How much nearer to something the arm may stand than it was told to [m]: 1 mrad at its reach."""


def stand(margin: float) -> float:
    """Return how much nearer than a margin the arm may stand [m].

    Args:
        margin: Distance that is to be kept [m].
    """
    return min(STAND, margin / 2.0)


def began(margin: float, clearance: float, before: float) -> float:
    """Return how near the arm's links were to each other when it began to unfold [m].

    Plans lead it no nearer than one :func:`stand` below that, and it rests at most another one
    below. Nearer still it was pushed, or homed, and begins anew.

    Args:
        margin: Distance that is to be kept [m].
        clearance: How near they are now [m].
        before: What this returned last; infinite where nothing is known of that.

    Returns:
        The margin where the arm is not folded up.
    """
    if clearance >= margin:
        return margin
    if clearance >= before - 2.0 * stand(margin):
        return before
    return margin if clearance >= margin - stand(margin) else clearance
