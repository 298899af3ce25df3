"""A press that jogs the first joint, by mouse, key or finger, and how it ends."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from bioscara.api import messages as m
from dashboard.rig import Site, at_rest, stays
from programs import wait_until
from served import HALF

RESTING = 0.8
"""Time in which the arm rests after the end of a press, and the owner has ended the jog [s]."""
EXPIRY = 0.25
"""Time without a beat after which the owner ends a jog [s]."""
J1 = '.jog-button[data-axis="0"]'


def towards(left: Site) -> int:
    """Return the direction of j1 that leads back to where the arm stood."""
    return 1 if left.robot.state.positions[0] < HALF[0] else -1


def moved(left: Site) -> bool:
    """Return whether the first joint moves soon."""
    end = time.monotonic() + 1.5
    while time.monotonic() < end:
        if abs(left.robot.state.velocities[0]) > 0.01:
            return True
    return False


def pressed(left: Site, press: Callable[[], object], release: Callable[[], object]) -> None:
    """Press until the first joint moves: a page that is late itself ends a jog, rightly."""
    for _ in range(4):
        press()
        if moved(left):
            return
        release()
        wait_until(lambda: at_rest(left.robot), "the arm rests")
    raise AssertionError("a press does not move j1")


def touch(devtools: Any, kind: str, *points: dict[str, float]) -> None:
    devtools.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": list(points)})


def ends(
    left: Site, act: Callable[[], object], *, expires: bool | None = False, after: float = 0.0
) -> None:
    """Require that an act ends the jog in time, and that the arm stays where it then is.

    Args:
        left: The arm.
        act: What ends it.
        expires: Whether the owner ends it as no beats come, and not the page; None for either.
        after: How long the act takes that has ended it already [s].
    """
    begin = time.monotonic()
    act()
    wait_until(lambda: at_rest(left.robot), "the jog ends", 3.0)
    took = time.monotonic() - begin
    assert took < RESTING + after + (0.0 if expires is False else EXPIRY), (
        f"it rested after {took:.3f} s"
    )
    goal = left.robot._ask(m.ListGoals(), m.GoalList).goals[-1]
    assert goal.name == "jog()"
    expired = goal.failure is not None and goal.failure.error == "JogExpiredError"
    assert expires in (None, expired), goal
    stays(left.robot)
