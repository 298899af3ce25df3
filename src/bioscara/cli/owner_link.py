"""A connection to the owner that a command is about, and the state of its arm in words."""

from __future__ import annotations

import math
import os
import pwd
import stat
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TypeVar

from bioscara.api import messages as m, runtime
from bioscara.cli.parser import Options
from bioscara.cli.shared_arguments import ARM_VARIABLE
from bioscara.control.faults.supervisor import FaultState
from bioscara.errors import (
    AccessError,
    ConfigurationError,
    InvalidArgumentError,
    OwnerError,
    OwnerLostError,
)
from bioscara.remote import GatewayAddress, RemoteRobot
from bioscara.remote.gateway import is_address
from bioscara.remote.link import OwnerLink

R = TypeVar("R", bound=m.Result)

_LONGEST_TOKEN = 300
"""Longest file of a token [byte]."""


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


def owner_of(options: Options, name: str | None = None) -> str | GatewayAddress:
    """Return the name of the owner that a command is about, or the way to it through its gateway.

    Args:
        options: Parsed options.
        name: Its name or address; None for that of the options, or of the only one.

    Raises:
        OwnerLostError, InvalidArgumentError: As of :func:`owner_name`, or the address or what goes
            with it cannot be used.
        AccessError: Others can read the file of the token.
        ConfigurationError: A file cannot be read.
    """
    name = name or owner_name(options)
    if not is_address(name):
        return name
    token = None if options.token_file is None else _token(options.token_file)
    return GatewayAddress(name, token, ca_file=options.ca_file, fingerprint=options.fingerprint)


def _token(path: Path) -> str:
    """Return the token in a file."""
    try:
        with path.open("rb") as file:
            status = os.fstat(file.fileno())
            content = file.read(_LONGEST_TOKEN + 1)
    except OSError as error:
        raise ConfigurationError(f"{path}: {error.strerror}") from error
    # Not of a pipe, by which a program gives it.
    if stat.S_ISREG(status.st_mode) and status.st_mode & 0o077:
        raise AccessError(
            f"{path} has mode {stat.S_IMODE(status.st_mode):04o}, and others may use the token in "
            f"it: chmod 600 {path}"
        )
    words = content[:_LONGEST_TOKEN].decode("ascii", errors="replace").split()
    if len(words) != 1 or len(content) > _LONGEST_TOKEN:
        raise ConfigurationError(
            f"{path} has not one token; write one of those of the gateway into it, and nothing else"
        )
    return words[0]


def served_robot(options: Options) -> RemoteRobot:
    """Return the served arm that a command is about; nothing is opened yet; raises as above."""
    return RemoteRobot(owner_of(options))


@contextmanager
def linked(owner: str | GatewayAddress, client: str | None = None) -> Iterator[OwnerLink]:
    """Connect to an owner within a block of code.

    Args:
        owner: Name of the owner, or the way to it.
        client: Name of this client; None for that of the program.
    """
    link = OwnerLink(owner, lambda _: None, lambda _: None, client=client)
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
