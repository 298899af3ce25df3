"""Commands for an arm that outlasts them: faults, power and the live table, over a socket."""

from __future__ import annotations

import os
import shlex
import signal
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from bioscara import Robot
from bioscara.model import load_parameters
from bioscara.sim import FirmwareBus, SimulatedArm, serve
from cli.said import Said

JOINTS = ("j1", "j2", "j3", "j4")


@pytest.fixture
def arm() -> SimulatedArm:
    """An arm."""
    return SimulatedArm(seed=2)


@pytest.fixture
def bus(arm: SimulatedArm, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """The name of a bus to that arm, which runs in a thread."""
    monkeypatch.chdir(tmp_path)
    path, listening, ended = tmp_path / "arm.sock", threading.Event(), threading.Event()
    thread = threading.Thread(
        target=lambda: serve(arm, path, ended.is_set, listening=listening.set)
    )
    thread.start()
    assert listening.wait(20)
    yield f"sim:{path}"
    ended.set()
    thread.join()


def overheat(arm: SimulatedArm, folder: Path) -> None:
    """Leave J3 with a latched fault, as an earlier program met it."""
    with Robot(FirmwareBus(arm), arm.clock, load_parameters(), "before", evidence=folder) as host:
        host.enable()
        arm.overheat("j3")
        arm.run(0.5)
        arm.overheat("j3", False)


@pytest.fixture
def hot(arm: SimulatedArm, tmp_path: Path) -> SimulatedArm:
    """The arm, with a latched fault."""
    overheat(arm, tmp_path / "before")
    return arm


def test_faults_stay_until_they_are_recovered_from(
    hot: SimulatedArm, bus: str, tmp_path: Path, said: Said
) -> None:
    of = ("--bus", bus)
    listed, acknowledged = said.output("faults", *of), said.output("acknowledge", *of)
    refused = said.failure("enable", *of)
    recovered, after = said.output("recover", *of), said.output("faults", *of)
    assert "OVERTEMPERATURE: j3" in listed
    assert f"bioscara recover --bus {bus}" in listed
    assert "evidence: " in acknowledged
    command = next(line for line in acknowledged.splitlines() if line.startswith("look at it: "))
    words = shlex.split(command.removeprefix("look at it: "))
    assert "fault 1: OVERTEMPERATURE: j3" in said.output(*words[1:])
    assert "OVERTEMPERATURE (j3)" in refused
    assert recovered.endswith("recovered\n")
    assert after.endswith("no faults\n")
    assert not any(hot.has_torque(name) for name in JOINTS)


@pytest.mark.parametrize(("command", "torque"), [("enable", True), ("monitor", False)])
def test_the_joints_are_shown_until_a_signal_and_are_disabled_then(
    command: str, torque: bool, arm: SimulatedArm, bus: str, said: Said
) -> None:
    seen: list[bool] = []

    def interrupt() -> None:
        seen.append(all(arm.has_torque(name) for name in JOINTS))
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(6.0, interrupt)
    timer.start()
    try:
        assert "watching" in said.output(command, "--bus", bus)
    finally:
        # After an early end the signal would reach the next test.
        timer.cancel()
    timer.join()
    assert seen == [torque]
    assert not any(arm.has_torque(name) for name in JOINTS)


def test_joints_that_another_program_left_enabled_are_disabled(
    arm: SimulatedArm, bus: str, said: Said
) -> None:
    assert said.output("disable --bus", bus).endswith("disabled\n")
    assert not any(arm.has_torque(name) for name in JOINTS)


def test_a_bus_in_use_is_named_with_its_user(bus: str, said: Said) -> None:
    with Robot.connect(bus):
        assert f"pid {os.getpid()}" in said.failure("monitor", "--bus", bus)
