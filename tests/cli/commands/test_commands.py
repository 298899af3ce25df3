"""Commands as typed, other than the demo: older joints, missing joints, real files, bad wires."""

from __future__ import annotations

import csv
import os
import re
import signal
import subprocess
from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import bioscara.cli.runs
import bioscara.sim
from bioscara.bus import Bus, Direction, FaultyBus, Transaction, When
from bioscara.cli import main
from bioscara.errors import CommunicationError
from bioscara.model import load_parameters
from bioscara.planning import read
from bioscara.protocol import Register
from bioscara.sim import FirmwareBus, SimulatedArm
from cli.said import Said
from served import HALF, NAME, arm_served

DATA = Path(__file__).parents[2] / "data"
PTP = str(DATA / "planned_pilz_ptp.yaml")
TOO_FAST = str(DATA / "planned_time_optimal.yaml")
SWING = str(Path(bioscara.cli.runs.__file__).with_name("demo.csv"))
LIMITS = {joint.name: joint for joint in load_parameters().joints}

Wire = Callable[[Callable[[SimulatedArm], Bus]], None]


@pytest.fixture
def wire(monkeypatch: pytest.MonkeyPatch) -> Wire:
    """Puts another bus in front of the arm that is simulated in this process."""
    return lambda make: monkeypatch.setattr(bioscara.sim, "BenchBus", lambda arm, _: make(arm))


def rows(folder: Path) -> list[dict[str, str]]:
    with (folder / "samples.csv").open(newline="") as file:
        return list(csv.DictReader(file, strict=True))


def line(text: str, name: str) -> str:
    """The line of a table that begins with ``name``."""
    found = re.search(rf"^ *{name} .*$", text, re.M)
    assert found, text
    return found[0]


def tracking_errors(folder: Path) -> dict[str, float]:
    """Largest tracking error of each joint during the trajectory [rad or m]."""
    return {
        name: max(
            abs(float(row[f"{name}_position"]) - float(row[f"{name}_reference"]))
            for row in rows(folder)
            if row["phase"] == "trajectory" and row[f"{name}_position"]
        )
        for name in LIMITS
    }


@pytest.mark.parametrize("words", [["joints"], ["joints", "--v1"]])
def test_a_missing_joint_is_named_and_the_others_are_listed(
    words: list[str], wire: Wire, said: Said
) -> None:
    def without_j3(arm: SimulatedArm) -> Bus:
        arm.set_power("j3", False)
        return FirmwareBus(arm)

    wire(without_j3)
    status, out, err = said(*words)
    assert status == 1
    assert "missing" in line(out, "j3")
    assert out.count("missing") == 1
    waited, missing = err.splitlines()
    assert "address of j3; waiting 1 s" in waited
    assert "j3" in missing
    assert "0x13" in missing


def test_a_run_with_a_missing_joint_is_refused_before_anything_moves(
    wire: Wire, tmp_path: Path, said: Said
) -> None:
    arms: list[SimulatedArm] = []

    def without_j3(arm: SimulatedArm) -> Bus:
        arms.append(arm)
        arm.set_power("j3", False)
        return FirmwareBus(arm)

    wire(without_j3)
    assert "j3" in said.refusal("run", PTP, "--out", str(tmp_path / "run"))
    assert not (tmp_path / "run").exists()
    assert not any(arms[0].has_torque(name) for name in LIMITS)


@pytest.mark.parametrize("words", [[], ["--v1"]])
def test_a_planned_trajectory_is_followed(words: list[str], tmp_path: Path, said: Said) -> None:
    out = said.output("run", PTP, "--out", str(tmp_path), *words)
    assert PTP in out
    version = "protocol 1" if words else "protocol 2"
    assert version in line((tmp_path / "report.txt").read_text(), "j1 +0x11")
    trajectory = [row for row in rows(tmp_path) if row["phase"] == "trajectory"]
    times = [float(row["time"]) for row in trajectory]
    assert (times[-1] - times[0]) / (len(times) - 1) == pytest.approx(
        0.02 if words else 0.01, rel=0.01
    )
    goal = read(Path(PTP)).trajectory
    for index, name in enumerate(goal.joint_names):
        span = LIMITS[name].upper - LIMITS[name].lower
        assert float(rows(tmp_path)[-1][f"{name}_position"]) == pytest.approx(
            goal.positions[-1, index], abs=1e-3 * span
        )
        if not words:
            assert tracking_errors(tmp_path)[name] < 2e-3 * span


def test_joints_that_a_trajectory_does_not_name_are_held_in_all_that_is_said_of_it(
    tmp_path: Path, said: Said
) -> None:
    file, folder = tmp_path / "some.csv", tmp_path / "run"
    file.write_text("time,j3,j1\n0,1.0,0.1\n2,1.2,0.3\n")
    dry = said.output("run", str(file), "--dry-run")
    out = said.output("run", str(file), "--out", str(folder))
    planned = read(folder / "trajectory.csv").trajectory
    assert planned.joint_names == tuple(LIMITS)
    assert planned.positions[-1, [0, 2]] == pytest.approx([0.3, 1.2])
    for name, place in (("j2", "+0.33"), ("j4", "+3.0")):
        column = planned.positions[:, planned.joint_names.index(name)]
        assert np.ptp(column) < 1e-9
        followed = [row for row in rows(folder) if row["phase"] == "trajectory"]
        references = [float(row[f"{name}_reference"]) for row in followed]
        assert references == pytest.approx([column[0]] * len(references), abs=1e-6)
        for text in (dry, out, (folder / "report.txt").read_text()):
            assert f"{name} at {place}" in text
    assert f"{planned.duration:.2f} s" in dry
    assert f"trajectory {planned.duration:.2f} s" in out


def test_a_dry_run_of_a_served_arm_begins_where_that_is(tmp_path: Path, said: Said) -> None:
    file, folder = tmp_path / "some.csv", tmp_path / "run"
    file.write_text("time,j1\n0,0.1\n0.5,0.3\n")
    with arm_served():
        words = ("run", str(file), "--arm", NAME)
        dry = said.output(*words, "--dry-run")
        assert main([*words, "--out", str(folder)], paced=False) == 0
        planned = read(folder / "trajectory.csv").trajectory
    assert np.ptp(planned.positions[:, 1:], axis=0) == pytest.approx(0.0, abs=1e-9)
    assert planned.positions[0, 1:] == pytest.approx(HALF[1:], abs=1e-3)
    assert f"{planned.duration:.2f} s" in dry
    assert f"j2 at {HALF[1]:+.3f}" in dry


def test_fit_stretches_it_and_says_by_how_much(tmp_path: Path, said: Said) -> None:
    command = ["run", TOO_FAST, "--fit", "--full-speed", "--out", str(tmp_path)]
    out = said.output(*command)
    told = re.search(r"stretched in time by (\d+\.\d+) to fit the limits", out)
    assert told
    duration = read(Path(TOO_FAST)).trajectory.duration
    executed = read(tmp_path / "trajectory.csv").trajectory
    assert executed.duration == pytest.approx(duration * float(told[1]), rel=1e-3)
    report = (tmp_path / "report.txt").read_text()
    assert "stretched in time" in report
    assert report.count("the trajectory's start is not at rest") == 1
    speeds = [
        abs(float(row["j2_velocity"])) for row in rows(tmp_path) if row["phase"] == "trajectory"
    ]
    assert max(speeds) == pytest.approx(LIMITS["j2"].max_velocity, rel=0.15)


class CtrlC(Bus):
    """Another bus, and a user pressing Ctrl-C when so many frames of a register passed."""

    def __init__(self, bus: Bus, register: Register, count: int) -> None:
        self._bus, self._first, self._count = bus, bytes((register,)), count

    def transfer(self, transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
        seen = sum(transaction.write[:1] == self._first for transaction in transactions)
        if seen and 0 < self._count <= seen:
            os.kill(os.getpid(), signal.SIGINT)
        self._count -= seen
        return self._bus.transfer(transactions)

    def close(self) -> None:
        self._bus.close()


def garble(bus: FaultyBus) -> None:
    for direction in Direction:
        bus.flip(direction, When(probability=0.01))
        bus.lose(direction, When(probability=0.005))


def deafen(bus: FaultyBus) -> None:
    bus.off(When(probability=0.02))


@pytest.mark.parametrize(
    ("register", "count", "phase", "spoil"),
    # Half of the setpoints ask for the load, too.
    [
        (Register.HOME, 1, "homing", garble),
        (Register.HOME, 3, "homing", deafen),
        (Register.TRACK, 50, "approach", deafen),
        (Register.TRACK, 2500, "trajectory", garble),
    ],
)
def test_ctrl_c_over_a_bad_wire_ramps_down_disables_and_reports(
    spoil: Callable[[FaultyBus], None],
    register: Register,
    count: int,
    phase: str,
    wire: Wire,
    tmp_path: Path,
    said: Said,
) -> None:
    arms: list[SimulatedArm] = []

    def make(arm: SimulatedArm) -> Bus:
        arms.append(arm)
        faulty = FaultyBus(FirmwareBus(arm), seed=5, clock=arm.clock)
        spoil(faulty)
        return CtrlC(faulty, register, count)

    wire(make)
    status, out, err = said("run", SWING, "--out", str(tmp_path))
    assert status == 130
    assert len(err.splitlines()) == 1
    assert "interrupted" in err
    assert ("before the start of the trajectory" in err) == (phase == "approach")
    assert "all joints were stopped and disabled" in out
    arm = arms[0]
    for name in LIMITS:
        assert not arm.has_torque(name)
        assert abs(arm.velocity(name)) < 1e-2
    samples = rows(tmp_path)
    last = [row for row in samples if row["phase"] != "stopping"][-1]
    assert last["phase"] == phase
    assert re.search(r"^  outcome +CANCELLED", (tmp_path / "report.txt").read_text(), re.M)
    assert (tmp_path / "plot.html").read_text().rstrip().endswith("</html>")
    assert all(None not in row and None not in row.values() for row in samples)
    for name, limit in LIMITS.items() if phase != "homing" else ():
        ramp = [row for row in samples if row["phase"] == "stopping"]
        speeds = [float(row[f"{name}_reference_velocity"]) for row in (last, *ramp)]
        steps = [abs(b - a) for a, b in pairwise(speeds)]
        assert max(steps) <= limit.max_acceleration * 0.02 * 1.5
        assert abs(speeds[-1]) < 1e-6


@pytest.mark.parametrize("words", [[], ["--v1"]])
def test_simulate_serves_from_its_message_until_a_signal(
    words: list[str], start: Callable[..., subprocess.Popen[str]], tmp_path: Path, said: Said
) -> None:
    path = tmp_path / "arm.sock"
    process = start("-m", "bioscara", "simulate", "--socket", str(path), *words, cold=True)
    assert process.stdout
    assert process.stdout.readline().endswith(f"--bus sim:{path}\n")
    listed = said.output("joints --bus", f"sim:{path}")
    process.send_signal(signal.SIGINT)
    assert process.wait(20) == 0
    assert not path.exists()
    version = "protocol 1" if words else "protocol 2"
    assert version in line(listed, "j4")


def test_a_socket_that_cannot_be_created_is_refused_without_a_message(
    tmp_path: Path, said: Said
) -> None:
    path = tmp_path / "nowhere" / "arm.sock"
    err = said.refusal("simulate --socket", str(path))
    assert str(path) in err
