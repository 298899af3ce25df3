"""Stop and disable every joint despite any earlier or further error."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack

from bioscara.drivers import Joint
from bioscara.errors import BioscaraError, JointResetError, NotInitializedError
from bioscara.protocol import Flags


def stop_and_disable(joints: Sequence[Joint]) -> list[str]:
    """Stop all joints, then disable one after the other; disabling waits for standstill.

    Each step is performed for each joint, also after a failure. One that a KeyboardInterrupt
    aborted is repeated, however often, and the interrupt is raised at the end. A joint that was
    deinitialised while it may be energised is initialised again.

    Returns:
        A message for each joint that could not be stopped or disabled.
    """
    problems: list[str] = []
    with ExitStack() as steps:
        # Last in, first out, and each is called even if an earlier one raised.
        for joint in reversed(joints):
            steps.callback(_attempt, joint, joint.disable, "may be energised", problems)
        for joint in reversed(joints):
            steps.callback(_attempt, joint, joint.stop, "may be moving", problems)
    return problems


def release(joints: Sequence[Joint]) -> list[str]:
    """Stop and disable all joints if one of them may be energised; else nothing is sent.

    Returns:
        A message for each joint that could not be stopped or disabled.
    """
    return stop_and_disable(joints) if any(joint.may_be_energised for joint in joints) else []


def _attempt(joint: Joint, step: Callable[[], None], risk: str, problems: list[str]) -> None:
    interrupt: BaseException | None = None
    while True:
        try:
            _perform(joint, step, risk, problems)
            break
        except (KeyboardInterrupt, SystemExit) as error:
            interrupt = error
    if interrupt is not None:
        raise interrupt


def _perform(joint: Joint, step: Callable[[], None], risk: str, problems: list[str]) -> None:
    try:
        if joint.may_be_energised and joint.version == 0:
            joint.init()
        step()
    except JointResetError as error:
        # It is off, unless SETUP found the restart: then the driver has tried to release it.
        joint.settings.may_be_energised = not joint.session.flags & Flags.NOTENABLED
        if joint.may_be_energised:
            problems.append(f"{joint.name} {risk}: {error}")
    except NotInitializedError:
        # It was never initialised, so it was never on, or it was released before ``deinit``.
        return
    except BioscaraError as error:
        problems.append(f"{joint.name} {risk}: {error}")
