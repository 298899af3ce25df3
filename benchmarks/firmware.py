"""The firmware's time on its controller, from the image as flashed, in emulation."""

from __future__ import annotations

import importlib
import subprocess
import sys
from pathlib import Path

from benchmarks.measure import Row

ROOT = Path(__file__).parents[1]
TICK_SHARE = 0.45
HOLD = 10e-6


def rows() -> list[Row]:
    """Measure ticks and clock stretching in virtual time: the same in each run of one image."""
    subprocess.run(["make", "--no-print-directory", "-s", "firmware"], cwd=ROOT, check=True)
    sys.path.insert(0, str(ROOT / "tests"))
    timing = importlib.import_module("emulator.timing")
    measured = timing.Measurement()
    share = measured.tick_worst / timing.PERIOD
    held = max(most for _, most in measured.holds.values())
    worst = max(
        (cost for cost in measured.costs if cost.what.startswith("tick")),
        key=lambda cost: cost.worst,
    )
    return [
        Row(
            "longest control tick, SPI at 2.6 MHz",
            f"{1e6 * measured.tick_worst:.0f} us, {100 * share:.0f} % of its period",
            f"{worst.what.removeprefix('tick, ')}; at rest {1e6 * measured.costs[0].mean:.0f} us",
            f"at most {100 * TICK_SHARE:.0f} %",
            share <= TICK_SHARE,
        ),
        Row(
            "SCL held in one write and read, 100 and 400 kHz",
            f"{1e6 * held:.1f} us",
            "a bit at 400 kHz: 2.5 us",
            f"at most {1e6 * HOLD:.0f} us",
            held <= HOLD,
        ),
    ]
