"""Output for an arm that a fault stopped, or that the computer is too slow for."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import pytest

import bioscara.sim
from bioscara import Robot
from bioscara.bus import Bus, Transaction
from bioscara.errors import CommunicationError
from bioscara.model import load_parameters
from bioscara.protocol import Register
from bioscara.sim import FirmwareBus, SimulatedArm
from cli.said import Said
from flight_records import read_record

NAMES = tuple(joint.name for joint in load_parameters().joints)


@pytest.fixture
def hot(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> SimulatedArm:
    """The arm of every command; J3 became too hot for the host before."""
    arm = SimulatedArm(seed=2)
    with Robot(FirmwareBus(arm), arm.clock, load_parameters(), "before", evidence=tmp_path) as host:
        host.enable()
        arm.overheat("j3")
        arm.run(0.5)
        arm.overheat("j3", False)
    monkeypatch.setattr(bioscara.sim, "SimulatedArm", lambda **_: arm)
    monkeypatch.chdir(tmp_path)
    return arm


@pytest.mark.parametrize(
    "words", [("demo", "--out", "my run"), ("move", "--joints", "0", "0.2", "0", "0")]
)
def test_host3_earlier_faults_must_be_acknowledged(
    words: tuple[str, ...], hot: SimulatedArm, tmp_path: Path, said: Said
) -> None:
    before = [hot.position(name) for name in NAMES]
    status, out, err = said(*words)
    assert status == 2
    assert "homing" not in out
    assert len(err.splitlines()) == 1
    assert "OVERTEMPERATURE (j3): let the joint's motor driver cool down" in err
    command = " ".join(words).replace("my run", "'my run'")
    assert err.endswith(f"then continue with: bioscara {command} --acknowledge\n")
    assert [hot.position(name) for name in NAMES] == pytest.approx(before, abs=1e-6)
    assert list(tmp_path.iterdir()) == []

    out = said.output(*words, "--acknowledge")
    assert out.index("acknowledged: OVERTEMPERATURE: j3") < out.index("homing")
    told = re.search(r"^evidence: (.*)$", out, re.M)
    assert told
    assert "OVERTEMPERATURE: j3" in read_record(Path(told[1])).faults[0]


def test_evidence_that_cannot_be_written_keeps_the_arm_stopped(
    hot: SimulatedArm, tmp_path: Path, said: Said
) -> None:
    (tmp_path / "faults").write_text("in the way")
    words = ("move", "--joints", "0", "0.2", "0", "0")
    assert "faults" in said.failure(*words, "--acknowledge")
    assert "OVERTEMPERATURE" in said.failure(*words)


def test_a_fault_of_this_run_names_the_next_step(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, said: Said
) -> None:
    arm = SimulatedArm(seed=2)
    monkeypatch.setattr(bioscara.sim, "SimulatedArm", lambda **_: arm)
    arm.remove_stops("j2")
    words = ("demo", "--out", str(tmp_path / "run"))
    status, out, err = said(*words)
    assert status == 1
    assert err.startswith("bioscara: HOMING_FAILED: j2")
    assert err.endswith("then continue with --acknowledge\n")
    assert "HOMING_FAILED: j2" in out
    assert "clear_fault()" not in out + err


class Slow(Bus):
    """A bus that now and then keeps the computer for longer than a cycle."""

    def __init__(self, arm: SimulatedArm) -> None:
        self._bus, self._arm, self._count = FirmwareBus(arm), arm, 0

    def transfer(self, transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
        if transactions[0].write[0] in (Register.TRACK, Register.TRACKLOAD):
            self._count += 1
            if self._count % 12 == 0:
                self._arm.run(0.012)
        return self._bus.transfer(transactions)

    def close(self) -> None:
        self._bus.close()


@pytest.mark.parametrize(
    "words", [("demo", "--out", "run"), ("move", "--joints", "0", "0.2", "0", "0")]
)
def test_half_speed_is_reported_with_its_reason(
    words: tuple[str, ...], monkeypatch: pytest.MonkeyPatch, tmp_path: Path, said: Said
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(bioscara.sim, "BenchBus", lambda arm, _: Slow(arm))
    out = said.output(*words)
    assert out.count("(): LATE: the loop does not keep 100 Hz") >= 1
    if words[0] == "demo":
        assert "LATE" in (tmp_path / "run" / "report.txt").read_text()
