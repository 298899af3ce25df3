"""``bioscara confirm``: confirm the bench that the last owner of an arm knew."""

from __future__ import annotations

from bioscara.cli.output.console import Output
from bioscara.cli.parser import Options, Parser
from bioscara.cli.shared_arguments import share_served


def arguments(parser: Parser) -> None:
    share_served(parser)


def run(options: Options, output: Output) -> None:
    """Declare that scene, tool and load of the last run still hold, and say what that is.

    Raises:
        LeaseError: Another client commands the arm.
    """
    from bioscara.api import messages as m
    from bioscara.cli.owner_link import asked, linked, owner_of
    from bioscara.remote import RemoteRobot

    name = owner_of(options)
    with linked(name) as link:
        unconfirmed = asked(link, m.GetWorkspace(), m.WorkspaceState).unconfirmed
    if unconfirmed:
        with RemoteRobot(name) as robot:
            robot.confirm_scene()
    for what in unconfirmed:
        output.line(f"{name}: {what} is confirmed")
    if not unconfirmed:
        output.line(f"{name}: there is nothing to confirm")
