"""``bioscara confirm``: confirm the bench that the last owner of an arm knew."""

from __future__ import annotations

from bioscara.api import messages as m
from bioscara.cli.commands.serving.owners import asked, linked, owner_name
from bioscara.cli.options import Options
from bioscara.cli.output.console import ExitStatus, Output
from bioscara.remote import RemoteRobot


def run(options: Options) -> int:
    """Declare that scene, tool and load of the last run still hold, and say what that is.

    Raises:
        OwnerLostError: No owner runs.
        InvalidArgumentError: There are several, and none is named.
        LeaseError: Another client commands the arm.
        OSError: Standard output cannot be written.
    """
    output, name = Output(), owner_name(options)
    with linked(name) as link:
        unconfirmed = asked(link, m.GetWorkspace(), m.WorkspaceState).unconfirmed
    if unconfirmed:
        with RemoteRobot(name) as robot:
            robot.confirm_scene()
    for what in unconfirmed:
        output.line(f"{name}: {what} is confirmed")
    if not unconfirmed:
        output.line(f"{name}: there is nothing to confirm")
    output.check()
    return ExitStatus.OK
