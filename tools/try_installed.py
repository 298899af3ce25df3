"""Use an installed bioscara as a new user would, in the empty folder that this is started in.

``PYTHON try_installed.py``, with nothing but the packages that this Python has. It prints each step
with its seconds, ends with 1 at the first that fails, and leaves ``samples.csv`` of the demo,
without its lateness, and ``plans.txt``, the checksums of ``motion_bits.py``, to compare computers
bit for bit.
"""

from __future__ import annotations

import csv
import io
import os
import signal
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

BIOSCARA = Path(sys.executable).parent / "bioscara"
HERE = Path(__file__).parent
PROGRAM = """
from bioscara import Robot

with Robot.connect("arm:lab") as robot:
    robot.move_joints([0.3, 0.2, 0.5, -0.5])
    assert abs(robot.state.positions[0] - 0.3) < 0.01, robot.state
"""
IMAGES = """
from bioscara.flashing.image import prebuilt, read_image

for joint in (1, 2, 3, 4):
    path = prebuilt(joint)
    assert "site-packages" in path.parts, path
    read_image(path).require(joint)
"""
PATIENCE = 600.0
"""Time that a step may take [s]; an emulated computer is 20 times as slow as this one."""


@contextmanager
def step(name: str) -> Iterator[None]:
    """Print a step with its time, or with the reason why it failed."""
    begun = time.monotonic()
    try:
        yield
    except (AssertionError, OSError, subprocess.SubprocessError) as error:
        output = getattr(error, "stdout", None) or ""
        sys.exit(f"  {name} failed: {error}\n{output}")
    sys.stdout.write(f"  {time.monotonic() - begun:6.1f} s  {name}\n")
    sys.stdout.flush()


def run(*words: object) -> str:
    """Run a program and return its output."""
    return subprocess.run(
        [str(word) for word in words],
        check=True,
        timeout=PATIENCE,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    ).stdout


def serve() -> None:
    """Serve an arm with its page, command it by a program, and end it."""
    words = (BIOSCARA, "serve", "--name", "lab", "--homed", "--with", "web --port 0")
    with subprocess.Popen(
        [str(word) for word in words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as owner:
        try:
            assert owner.stdout
            page = next(word for line in owner.stdout for word in line.split() if "http:" in word)
            with urllib.request.urlopen(page, timeout=PATIENCE) as answer:
                assert b"<!doctype html>" in answer.read(), page
            run(sys.executable, "-c", PROGRAM)
        finally:
            owner.send_signal(signal.SIGINT)
        assert owner.wait(PATIENCE) in {0, 130}, owner.returncode


def plan_service() -> None:
    """Let the service be planned; where services do not see this Python, that has to be said."""
    words = (BIOSCARA, "service", "install", "lab", "--bus", "sim", "--dry-run")
    done = subprocess.run(words, capture_output=True, text=True, timeout=PATIENCE, check=False)
    if done.returncode == 2:
        assert "is hidden from services; install it elsewhere" in done.stderr, done.stderr
    else:
        assert "would write /etc/systemd/system/bioscara@.service" in done.stdout, done


def without_lateness(samples: str) -> str:
    """Return samples of a recording without how late each cycle began: that is this computer's."""
    rows = list(csv.reader(io.StringIO(samples)))
    late = rows[0].index("late")
    kept = io.StringIO()
    csv.writer(kept).writerows(row[:late] + row[late + 1 :] for row in rows)
    return kept.getvalue()


def main() -> None:
    """Try everything."""
    with tempfile.TemporaryDirectory(dir="/tmp") as runtime:  # as paths of sockets are short
        os.environ["BIOSCARA_RUNTIME"] = runtime
        with step("bioscara --version"):
            version = run(BIOSCARA, "--version")
        sys.stdout.write(f"{'':12}{version}")
        with step("bioscara demo"):
            run(BIOSCARA, "demo")
            (samples,) = Path("runs").glob("*/samples.csv")
            Path("samples.csv").write_text(without_lateness(samples.read_text()))
        with step("bioscara plan"):
            run(BIOSCARA, "plan", "--name", "center")
        with step("plans of 72 motions"):
            Path("plans.txt").write_text(run(sys.executable, HERE / "motion_bits.py"))
        with step("the images of the joints"):
            run(sys.executable, "-c", IMAGES)
        with step("bioscara serve, its page and a program"):
            serve()
        with step("bioscara service install --dry-run"):
            plan_service()


if __name__ == "__main__":
    main()
