"""The main job from the outside: statuses, messages, files, and Ctrl-C in each phase."""

from __future__ import annotations

import csv
import json
import os
import re
import resource
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import bioscara.cli.runs
from bioscara.physics import engine
from bioscara.planning import read
from bioscara.report import Phase
from cli.said import Said
from programs import wait_for_line

SWING = str(Path(bioscara.cli.runs.__file__).with_name("demo.csv"))
"""A trajectory of 16 s."""
TOO_FAST = str(Path(__file__).parents[2] / "data/planned_time_optimal.yaml")


def samples(folder: Path) -> list[dict[str, str]]:
    """Return the rows, after a check that all of them are whole."""
    with (folder / "samples.csv").open(newline="") as file:
        rows = list(csv.DictReader(file, strict=True))
    assert all(None not in row and None not in row.values() for row in rows)
    assert {row["phase"] for row in rows} <= {phase.value for phase in Phase}
    times = [float(row["time"]) for row in rows]
    assert times == sorted(times)
    return rows


def assert_complete(folder: Path, outcome: str) -> None:
    """Assert that report, page and samples parse, and state the outcome."""
    assert re.search(rf"^  outcome +{outcome}", (folder / "report.txt").read_text(), re.M)
    page = (folder / "plot.html").read_text()
    data = re.search(r'<script id="data" type="application/json">(.*?)</script>', page, re.S)
    assert data
    json.loads(data[1])
    assert samples(folder)
    if (folder / "trajectory.csv").exists():
        assert read(folder / "trajectory.csv").trajectory.duration > 0.0
    assert not list(folder.glob("partial-*"))


def test_the_demo_carries_a_plate_and_reports(tmp_path: Path, said: Said) -> None:
    out = said.output("demo --fast --out", str(tmp_path))
    assert "the plate was held in the air" in out
    placed = re.search(r"placed (\d\.\d\d) mm from its place in nest b", out)
    assert placed
    assert float(placed[1]) < 1.0
    assert_complete(tmp_path, "completed")
    times = [float(row["trajectory_time"]) for row in samples(tmp_path) if row["trajectory_time"]]
    assert times == sorted(times)


def test_without_the_physics_engine_the_demo_follows_a_trajectory(
    tmp_path: Path, said: Said, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(engine, "is_installed", lambda: False)
    out = said.output("demo --out", str(tmp_path))
    assert "arm: simulation, in this process" in out
    assert "note: without the physics engine" in out
    assert "bioscara[physics]" in out
    assert (tmp_path / "trajectory.csv").exists()
    assert_complete(tmp_path, "completed")
    rows = samples(tmp_path)
    assert {row["phase"] for row in rows} == {"homing", "approach", "trajectory", "settling"}
    homed = [
        next(i for i, row in enumerate(rows) if not int(row[f"{name}_flags"]) & 4)
        for name in ("j2", "j1", "j4", "j3")
    ]
    assert homed == sorted(homed)


@pytest.mark.parametrize(
    ("words", "marker"),
    [
        (("demo", "--realtime"), "  homing"),
        pytest.param(("demo",), "carrying it", marks=pytest.mark.thorough),
        (("run", SWING), "  approach"),
        (("run", SWING), "  trajectory"),
    ],
    ids=["homing", "carrying", "approach", "trajectory"],
)
def test_ctrl_c_in_each_phase_stops_and_reports(
    words: tuple[str, ...], marker: str, start: Callable[..., subprocess.Popen[str]], tmp_path: Path
) -> None:
    demos = {
        number: start(
            "-m", "bioscara", *words, "--out", str(tmp_path / number.name),
            stderr=subprocess.PIPE,
        )
        for number in (signal.SIGINT, signal.SIGTERM)
    }  # fmt: skip
    for number, demo in demos.items():
        wait_for_line(demo, marker)
        demo.send_signal(number)
        demo.send_signal(number)
        out, err = demo.communicate(timeout=60)
        assert demo.returncode == 130
        assert len(err.splitlines()) == 1
        # Between two motions the next one does not begin any more.
        between = "was stopped before anything moved" in err
        assert "interrupted" in err or between
        assert "all joints were stopped and disabled" in out
        assert_complete(tmp_path / number.name, "CANCELLED")
        ended = samples(tmp_path / number.name)[-1]["phase"]
        assert ended == ("settling" if between else "stopping")


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["run", "/no/such/file.yaml"], "/no/such/file.yaml"),
        (["run", "/dev/null"], "/dev/null"),
        (["run", "/bin/true"], "/bin/true"),
        (["run", "/"], "/: "),
        (["demo", "--out", "/proc/run"], "/proc/run"),
        (["demo", "--bus", "linus:1"], "linus:1"),
        (["demo", "--bus", "linux:99"], "99"),
        (["joints", "--bus", "linux:99"], "99"),
        (["joints", "--bus", "sim:/no/such.sock"], "/no/such.sock"),
        (["run", TOO_FAST], "; fit(), or bioscara run --fit, stretches it"),
    ],
)
def test_a_refusal_is_one_line_before_anything_moves(
    words: list[str], complaint: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, said: Said
) -> None:
    monkeypatch.chdir(tmp_path)
    status, out, err = said(*words)
    assert (status, len(err.splitlines())) == (2, 1)
    assert complaint in err
    assert "homing" not in out
    assert list(tmp_path.iterdir()) == []


def limited_to(size: int) -> Callable[[], None]:
    return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))


UNPACED = f"""\
import sys
sys.path.insert(0, {str(Path(__file__).parents[2])!r})
from bioscara.cli import main
from cli.said import Said
from simulated import standing_near_the_stops
with standing_near_the_stops():
    sys.exit(main(sys.argv[1:], paced=False))
"""


def run_unpaced(*words: str, **options: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", UNPACED, *words],
        stderr=subprocess.PIPE,
        text=True,
        check=False,
        timeout=110,
        **{"stdout": subprocess.PIPE, **options},  # type: ignore[call-overload]
    )


def test_a_disk_that_fills_up_stops_the_recording_and_not_the_arm(tmp_path: Path) -> None:
    done = run_unpaced("run", SWING, "--out", str(tmp_path), preexec_fn=limited_to(50_000))
    assert done.returncode == 1
    assert "recording stopped, the motion goes on" in done.stdout
    assert re.search(r"^  outcome +completed", (tmp_path / "report.txt").read_text(), re.M)
    assert re.search(r"samples end \d+\.\d+ s after the start", done.stderr)
    assert "plot.html was not written" in done.stderr
    assert "Traceback" not in done.stderr
    assert samples(tmp_path)


def test_a_closed_pipe_stops_nothing(tmp_path: Path) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    done = run_unpaced("run", SWING, "--out", str(tmp_path), stdout=writing)
    os.close(writing)
    assert done.returncode == 1
    assert done.stderr == ""
    assert_complete(tmp_path, "completed")


def test_output_that_cannot_be_written_is_reported_at_the_end(tmp_path: Path) -> None:
    with open("/dev/full", "w") as full:
        done = run_unpaced("run", SWING, "--out", str(tmp_path), stdout=full)
    assert done.returncode == 1
    assert done.stderr.splitlines() == [
        "bioscara: the output cannot be written: No space left on device"
    ]
    assert_complete(tmp_path, "completed")


def test_a_folder_with_a_run_is_not_overwritten(tmp_path: Path, said: Said) -> None:
    (tmp_path / "samples.csv").write_text("precious\n")
    assert "holds a run already" in said.failure("demo --out", str(tmp_path))
    assert (tmp_path / "samples.csv").read_text() == "precious\n"
