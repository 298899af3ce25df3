"""Runs the benchmarks and writes docs/benchmarks.md."""

from __future__ import annotations

import importlib
import os
import platform
import sys
from pathlib import Path

TOPICS = {
    "simulation": "Simulation",
    "cycle": "One control cycle",
    "control": "The control loop",
    "clearance": "Keeping clear",
    "tracking": "Tracking a ramp",
    "kinematics": "Kinematics",
    "trajectory_sampling": "Sampling a trajectory",
    "planning": "Planning",
    "linear": "Lines of the tool",
    "point_to_point": "Point to point",
    "startup": "Start-up",
}
PAGE = Path(__file__).parents[1] / "docs" / "benchmarks.md"


def main() -> int:
    """Run all topics; return 1 when a limit does not hold."""
    lines = [
        "# Benchmarks",
        "",
        "Written by `make bench`. Absolute times are this run's and drift with the machine; the",
        "limits are ratios, or bounds with ample room.",
        "",
        f"Python {platform.python_version()}, {platform.machine()}, {os.cpu_count()} cores.",
    ]
    failed = []
    for module, title in TOPICS.items():
        print(f"{title} ...", flush=True)
        lines += ["", f"## {title}", "", "| what | measured | against | limit | |"]
        lines.append("| --- | --- | --- | --- | --- |")
        for row in importlib.import_module(f"benchmarks.{module}").rows():
            mark = "holds" if row.holds else "**does not hold**"
            line = f"| {row.what} | {row.value} | {row.reference} | {row.limit} | {mark} |"
            print(line, flush=True)
            lines.append(line)
            if not row.holds:
                failed.append(row.what)
    PAGE.write_text("\n".join(lines) + "\n")
    print(f"wrote {PAGE}")
    for what in failed:
        print(f"does not hold: {what}", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
