"""Resolving a switch request into the controllers that change, before anything changes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from enum import IntEnum
from typing import NamedTuple

from bioscara.arguments import items, shown, text
from bioscara.control.controllers.controller import AnyController
from bioscara.errors import SwitchError
from bioscara.hardware import LifecycleState
from bioscara.spelling import did_you_mean


class Strictness(IntEnum):
    """Handling of an entry that cannot be switched; the numbers are ROS's.

    ROS's 0 is the default, STRICT; its 3 and 4, AUTO and FORCE_AUTO, act as BEST_EFFORT.
    """

    BEST_EFFORT = 1
    """Leave it out."""
    STRICT = 2
    """Refuse the whole switch."""

    @classmethod
    def _missing_(cls, value: object) -> Strictness | None:
        if value == 0:
            return cls.STRICT
        return cls.BEST_EFFORT if value in (3, 4) else None


class Switch(NamedTuple):
    """Controllers that change, in the order in which they do.

    Attributes:
        activate: To be activated, after all others were deactivated.
        deactivate: To be deactivated.
        strictness: Handling of controllers that cannot be activated.
    """

    activate: tuple[AnyController, ...]
    deactivate: tuple[AnyController, ...]
    strictness: Strictness = Strictness.STRICT

    @property
    def text(self) -> str:
        """ROS's message for a switch that succeeded."""
        if not self.activate and not self.deactivate:
            return (
                "After checking the controllers, no controllers need to be activated or "
                "deactivated."
            )
        done = "Successfully switched controllers!"
        return done if self.strictness is Strictness.STRICT else f"{done} {self.lists()}"

    def lists(self) -> str:
        """Return the names of the controllers that were activated and deactivated."""
        active = [each.name for each in self.activate if each.state is LifecycleState.ACTIVE]
        left = [each.name for each in self.deactivate if each.state is not LifecycleState.ACTIVE]
        return f"Activated: [{', '.join(active)}]; deactivated: [{', '.join(left)}]"


def plan(
    controllers: Mapping[str, AnyController],
    activate: Sequence[str],
    deactivate: Sequence[str],
    strictness: Strictness,
) -> Switch:
    """Resolve a switch request into an ordered plan; a name in both lists is a restart.

    Raises:
        SwitchError: STRICT and an entry cannot be switched, or none of the names of a list
            exists.
    """
    leaving = _select(controllers, deactivate, strictness, _not_active)
    restarting = {controller.name for controller in leaving}
    entering = _select(
        controllers,
        activate,
        strictness,
        lambda controller: "" if controller.name in restarting else _not_inactive(controller),
    )
    return Switch(tuple(entering), tuple(leaving), strictness)


def unknown(name: str, known: Iterable[str], what: str = "controller") -> str:
    """Return the error message about an unknown name."""
    names = sorted(known)
    hint = did_you_mean(name, names, f"there are: {', '.join(names) or 'none'}")
    return f"no {what} is named {shown(name)}; {hint}"


def _select(
    controllers: Mapping[str, AnyController],
    names: Sequence[str],
    strictness: Strictness,
    objection: Callable[[AnyController], str],
) -> list[AnyController]:
    selected: list[AnyController] = []
    names = items("the names of controllers", names, "give a list")
    for name in names:
        text("the name of a controller", name)
    if names and not any(name in controllers for name in names):
        raise SwitchError(unknown(names[0], controllers))
    for name in dict.fromkeys(names):
        controller = controllers.get(name)
        reason = unknown(name, controllers) if controller is None else objection(controller)
        if reason and strictness is Strictness.STRICT:
            raise SwitchError(reason)
        if controller is not None and not reason:
            selected.append(controller)
    return selected


def _not_active(controller: AnyController) -> str:
    if controller.state is LifecycleState.ACTIVE:
        return ""
    return f"{controller.name} cannot be deactivated: it is {controller.state.label}, not active"


def _not_inactive(controller: AnyController) -> str:
    if controller.state is LifecycleState.INACTIVE:
        return ""
    remedy = "; configure it first" if controller.state is LifecycleState.UNCONFIGURED else ""
    return (
        f"{controller.name} cannot be activated: it is {controller.state.label}, not "
        f"inactive{remedy}"
    )
