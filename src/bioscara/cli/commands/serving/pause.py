"""``bioscara pause`` and ``bioscara resume``: pauses of served arms."""

from __future__ import annotations

import os
import pwd

from bioscara.api import messages as m
from bioscara.api import runtime
from bioscara.cli.commands.serving.owners import asked, linked, owner_name
from bioscara.cli.options import Options
from bioscara.cli.output.console import ExitStatus, Output
from bioscara.errors import LeaseError, OwnerLostError


def run(options: Options) -> int:
    """Pause all motion of an arm, or of all that are served; or lift the pause of an arm.

    Raises:
        OwnerLostError: No owner runs.
        InvalidArgumentError: There are several, and none is named whose pause is lifted.
        LeaseError: Others have paused, and another client commands the arm.
        OSError: Standard output cannot be written.
    """
    output = Output()
    if options.command == "resume":
        _resume(owner_name(options), output)
    else:
        _pause(options.arm, output)
    output.check()
    return ExitStatus.OK


def _pause(name: str | None, output: Output) -> None:
    # All, as by a stop: to come to rest is safe.
    names = [name] if name else [owner.name for owner in runtime.owners()]
    if not names:
        raise OwnerLostError("no arm is served, so none was paused")
    for each in names:
        with linked(each, _author()) as link:
            link.request(m.Pause())
        output.line(f"{each} is paused; continue with: bioscara resume --arm {each}")


def _resume(name: str, output: Output) -> None:
    with linked(name, _author()) as link:
        if not asked(link, m.GetState(), m.StateSample).paused:
            output.line(f"{name} is not paused")
            return
        try:
            link.request(m.Resume())
        except LeaseError as error:
            if error.holder:
                raise
            epoch = asked(link, m.AcquireLease(), m.LeaseState).lease.epoch
            link.request(m.Resume())
            link.request(m.ReleaseLease(), epoch)
        left = asked(link, m.GetState(), m.StateSample).paused_by
    output.line(f"{name} stays paused by {', '.join(left)}" if left else f"{name} continues")


def _author() -> str:
    """Return the name of this user: each command is a client of its own, and any lifts a pause."""
    try:
        user = pwd.getpwuid(os.getuid()).pw_name
    except KeyError:
        user = f"user {os.getuid()}"
    return f"bioscara ({user})"
