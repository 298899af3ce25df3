"""Print the arguments of launch files with their defaults as JSON, as ``--show-args`` finds them.

    launch_arguments.py FILE...

Run with a Python that has the launch of ROS 2.
"""

from __future__ import annotations

import json
import sys

from launch import LaunchContext
from launch.launch_description_sources import get_launch_description_from_any_launch_file
from launch.utilities import perform_substitutions


def arguments_of(path: str) -> dict[str, str | None]:
    """Return the default of each argument of a launch file; None where there is none."""
    context = LaunchContext()
    declared = get_launch_description_from_any_launch_file(path).get_launch_arguments()
    return {
        each.name: each.default_value and perform_substitutions(context, each.default_value)
        for each in declared
    }


if __name__ == "__main__":
    print(json.dumps([arguments_of(path) for path in sys.argv[1:]]))  # noqa: T201
