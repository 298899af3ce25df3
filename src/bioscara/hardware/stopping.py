"""Bringing every joint to rest and off, whatever went wrong before or goes wrong meanwhile."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack

from bioscara.drivers import Joint
from bioscara.errors import BioscaraError, JointResetError, NotInitializedError


def stop_and_disable(joints: Sequence[Joint]) -> list[str]:
    """Stop all joints, then disable one after the other; disabling waits for standstill.

    Each step is taken for each joint, also after a failure and after a KeyboardInterrupt, which
    is raised at the end.

    Returns:
        A sentence for each joint that could not be stopped or disabled.
    """
    problems: list[str] = []
    with ExitStack() as steps:
        # Last in, first out, and each is called whatever an earlier one raised.
        for joint in reversed(joints):
            steps.callback(_attempt, joint.disable, f"{joint.name} may be energised", problems)
        for joint in reversed(joints):
            steps.callback(_attempt, joint.stop, f"{joint.name} may be moving", problems)
    return problems


def _attempt(step: Callable[[], None], consequence: str, problems: list[str]) -> None:
    try:
        step()
    except (JointResetError, NotInitializedError):
        # A joint that restarted is off, and one that was never greeted was never on.
        return
    except BioscaraError as error:
        problems.append(f"{consequence}: {error}")
