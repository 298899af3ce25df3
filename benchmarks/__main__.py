"""Runs the benchmarks; where all of them ran, writes docs/benchmarks.md."""

from __future__ import annotations

import argparse
import difflib
import importlib
import os
import platform
import sys
from collections.abc import Sequence
from pathlib import Path

TOPICS = {
    "simulation": "Simulation",
    "physics": "Bodies around the arm",
    "firmware": "Firmware, emulated",
    "cycle": "One control cycle",
    "control": "The control loop",
    "clearance": "Keeping clear",
    "mechanics": "The simulated motors compared with those of the arm",
    "tracking": "Tracking a ramp",
    "kinematics": "Kinematics",
    "trajectory_sampling": "Sampling a trajectory",
    "planning": "Planning",
    "linear": "Lines of the tool",
    "point_to_point": "Point to point",
    "server": "The owner and its clients",
    "hostile": "Hostile clients",
    "ros": "ROS 2",
    "files": "Reading files",
    "recording": "Recording",
    "web": "On the web",
    "dashboard": "The dashboard",
    "startup": "Start-up",
}
PAGE = Path(__file__).parents[1] / "docs" / "benchmarks.md"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the topics that are named, or all; return 1 when a limit is exceeded.

    Args:
        arguments: Names of topics; the words of the process by default.
    """
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks",
        description="Run benchmarks and print them; all of them also write docs/benchmarks.md.",
    )
    known = ", ".join(TOPICS)
    parser.add_argument(
        "topics", metavar="TOPIC", nargs="*", type=_topic, help=f"{known} (default: all)"
    )
    wanted = set(parser.parse_args(arguments).topics) or set(TOPICS)
    lines, failed = [], []
    for module, title in TOPICS.items():
        if module in wanted:
            rows, missed = _run(module, title)
            lines += rows
            failed += missed
    if wanted == set(TOPICS):
        PAGE.write_text("\n".join([*_heading(), *lines]) + "\n")
        print(f"wrote {PAGE}")
    for what in failed:
        print(f"does not hold: {what}", file=sys.stderr)
    return 1 if failed else 0


def _topic(name: str) -> str:
    if name not in TOPICS:
        near = difflib.get_close_matches(name, TOPICS, 1)
        hint = f"did you mean {near[0]}?" if near else f"there are {', '.join(TOPICS)}"
        raise argparse.ArgumentTypeError(f"there is no topic {name!r}; {hint}")
    return name


def _heading() -> list[str]:
    return [
        "# Benchmarks",
        "",
        "Written by `make bench`. Times are this run's and differ between computers. No limit is a",
        "time: each is a ratio to a reference that was measured in turns with it or at once, or",
        "concerns the simulated arm, where time is virtual; those of the dashboard are budgets.",
        "",
        f"Python {platform.python_version()}, {platform.machine()}, {os.cpu_count()} cores.",
    ]


def _run(module: str, title: str) -> tuple[list[str], list[str]]:
    """Run one topic; return its part of the page, and the rows that exceed their limit."""
    print(f"{title} ...", flush=True)
    lines = ["", f"## {title}", "", "| what | measured | against | limit | |"]
    lines.append("| --- | --- | --- | --- | --- |")
    failed = []
    for row in importlib.import_module(f"benchmarks.{module}").rows():
        mark = "holds" if row.holds else "**does not hold**"
        line = f"| {row.what} | {row.value} | {row.reference} | {row.limit} | {mark} |"
        print(line, flush=True)
        lines.append(line)
        if not row.holds:
            failed.append(row.what)
    return lines, failed


if __name__ == "__main__":
    sys.exit(main())
