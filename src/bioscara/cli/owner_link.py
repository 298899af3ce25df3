"""A connection to the owner that a command is about, and the state of its arm in words."""

from __future__ import annotations

import math
import os
import pwd
from collections.abc import Iterator
from contextlib import closing, contextmanager
from typing import TypeVar

from bioscara.api import messages as m, runtime
from bioscara.cli.parser import Options
from bioscara.cli.shared_arguments import ARM_VARIABLE
from bioscara.control.faults.supervisor import FaultState
from bioscara.errors import InvalidArgumentError, OwnerError, OwnerLostError
from bioscara.remote.link import OwnerLink

R = TypeVar("R", bound=m.Result)


def owner_name(options: Options) -> str:
    """Return the name of the owner that a command is about.

    Raises:
        OwnerLostError: No owner runs.
        InvalidArgumentError: There are several, and none is named.
    """
    if name := options.arm or os.environ.get(ARM_VARIABLE):
        return name
    running = [owner.name for owner in runtime.owners()]
    if not running:
        raise OwnerLostError(
            f"no arm is served; bioscara serve starts an owner{runtime.unlisted()}"
        )
    if len(running) > 1:
        raise InvalidArgumentError(
            f"there are the arms {', '.join(running)}; choose one with --arm NAME"
        )
    return running[0]


@contextmanager
def linked(name: str, client: str | None = None) -> Iterator[OwnerLink]:
    """Connect to an owner within a block of code.

    Args:
        name: Name of the owner.
        client: Name of this client; None for that of the program.
    """
    link = OwnerLink(name, lambda _: None, lambda _: None, client=client)
    with closing(link):
        link.open()
        yield link


def asked(link: OwnerLink, command: m.AnyCommand, kind: type[R]) -> R:
    """Return the answer of an owner to a request."""
    result = link.request(command)
    if not isinstance(result, kind):
        raise OwnerError(f"the owner answered {type(result).__name__}, not {kind.__name__}")
    return result


def state_words(state: m.StateSample) -> str:
    """Return the state of an arm in words."""
    words = ["enabled" if state.enabled else "disabled"]
    if any(map(math.isnan, state.positions)):
        words.append("unknown" if state.stale else "not homed")
    if state.fault is not FaultState.CLEAR:
        words.insert(0, f"fault {state.fault.value}")
    if state.paused:
        # A recording of an older version does not have the names.
        authors = f" by {', '.join(state.paused_by)}" if state.paused_by else ""
        words.append(f"paused{authors}")
    return ", ".join([*words, *state.moving])


def author() -> str:
    """Return the name of this user: each command is a client of its own, and any lifts a pause."""
    try:
        user = pwd.getpwuid(os.getuid()).pw_name
    except KeyError:
        user = f"user {os.getuid()}"
    return f"bioscara ({user})"
