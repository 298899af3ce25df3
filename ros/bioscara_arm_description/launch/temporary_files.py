"""Remove the temporary files of launch when it ends.

For parameters of a program that are no file, launch writes one, and does not remove it. A launch
file includes this one before its programs.
"""

from __future__ import annotations

import atexit
from itertools import pairwise
from pathlib import Path

from launch import LaunchContext, LaunchDescription
from launch.actions import RegisterEventHandler
from launch.event_handlers import OnProcessStart
from launch.events.process import ProcessStarted

PREFIX = "launch_params_"
"""Begin of the names of these files."""


def generate_launch_description() -> LaunchDescription:
    """Return the action that notes the files of each program."""
    return LaunchDescription([RegisterEventHandler(OnProcessStart(on_start=note))])


def note(started: ProcessStarted, _: LaunchContext) -> None:
    """Remove the files of a program at the end: one that is started anew reads them again."""
    for option, value in pairwise(started.cmd):
        path = Path(value)
        if option == "--params-file" and path.name.startswith(PREFIX):
            atexit.register(path.unlink, missing_ok=True)
