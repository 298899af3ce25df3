"""Bringing every joint to rest and off, whatever went wrong before or goes wrong meanwhile."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack

from bioscara.clock import Clock
from bioscara.drivers import Joint, Quality, read_states
from bioscara.errors import BioscaraError

_POLL = 0.02
_REST_TIMEOUT = 1.0
"""The longest ramp from full speed takes 0.5 s (J1, 1 rad/s at 2 rad/s^2)."""
_REST = {"rad": 5e-3, "m": 2e-4}
"""Speed below which a joint counts as standing: its speed filter's ripple [rad/s, m/s]."""


def stop_and_disable(joints: Sequence[Joint], clock: Clock) -> list[str]:
    """Stop all joints, wait until they stand, disable all of them.

    Each step is taken for each joint, also after a failure and after a KeyboardInterrupt, which
    is raised at the end.

    Returns:
        A sentence for each joint that could not be stopped or disabled.
    """
    problems: list[str] = []
    with ExitStack() as steps:
        # Last in, first out, and each is called whatever an earlier one raised.
        for joint in reversed(joints):
            steps.callback(attempt, joint.disable, f"{joint.name} may be energised", problems)
        steps.callback(_await_rest, joints, clock)
        for joint in reversed(joints):
            steps.callback(attempt, joint.stop, f"{joint.name} may be moving", problems)
    return problems


def attempt(step: Callable[[], None], consequence: str, problems: list[str]) -> None:
    """Take one step; on failure add what follows from it to ``problems``."""
    try:
        step()
    except BioscaraError as error:
        problems.append(f"{consequence}: {error}")


def _await_rest(joints: Sequence[Joint], clock: Clock) -> None:
    """Wait until no joint that answers moves: one without current would coast."""
    end = clock.now() + _REST_TIMEOUT
    while clock.now() < end:
        try:
            samples = read_states(joints)
        except BioscaraError:
            # Nobody can be asked; the joints have their own watchdog, and this is long enough.
            clock.sleep_until(end)
            return
        if all(
            sample.quality is not Quality.FRESH or abs(sample.velocity) < _REST[joint.unit]
            for joint, sample in zip(joints, samples, strict=True)
        ):
            return
        clock.sleep_until(clock.now() + _POLL)
