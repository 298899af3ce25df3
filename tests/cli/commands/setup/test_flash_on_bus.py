"""Flashing a joint on a bus: the bootloader is requested before, the identity checked after."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from bioscara.bus import Bus, Transaction
from bioscara.cli import main
from bioscara.drivers import Joint
from bioscara.errors import (
    CommunicationError,
    IncorrectStateError,
    NoAcknowledgeError,
    NotSupportedError,
    RefusedError,
)
from bioscara.model import load_parameters
from bioscara.protocol import READ, Refusal, Register, ResetCause
from bioscara.robot.connection import devices
from bioscara.sim import FirmwareBus, SimulatedArm
from flashing.images import image
from flashing.stand_ins import Bench

SERIALS = {"j1": "3569366E3037", "j2": "2071345B3037"}
PARAMETERS = {joint.name: joint for joint in load_parameters().joints}


class Arm(Bus):
    """An arm whose joints are connected by USB: a joint that leaves its firmware shows up there."""

    def __init__(self, arm: SimulatedArm, tools: Bench) -> None:
        self.arm, self.tools, self._bus = arm, tools, FirmwareBus(arm)
        self.in_bootloader: set[str] = set()
        self.restarted: set[str] = set()
        self.lost = False

    def transfer(self, transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
        for name, serial in SERIALS.items():
            if serial in self.tools.started() and name not in self.restarted:
                self.restarted.add(name)
                self.in_bootloader.discard(name)
                self.arm.reset(name, ResetCause.SOFTWARE)
                self.arm.clock.sleep_until(self.arm.now() + 0.5)
        results = self._bus.transfer(transactions)
        if any(each.write[0] == Register.BOOTLOADER for each in transactions):
            self.arm.clock.sleep_until(self.arm.now() + 0.03)
            for name in set(SERIALS) - self.in_bootloader:
                if not self.answers(name):
                    self.in_bootloader.add(name)
                    self.tools.board(SERIALS[name])
            if self.lost:
                return [NoAcknowledgeError("lost", each.address) for each in transactions]
        return results

    def answers(self, name: str) -> bool:
        ping = READ[Register.PING]
        address = PARAMETERS[name].address
        (answer,) = self._bus.transfer((Transaction(address, ping.encode_v1(), 2),))
        return isinstance(answer, bytes)

    def close(self) -> None:
        pass


@pytest.fixture
def arm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Arm]:
    """Makes an arm that `linux:1` leads to, in virtual time."""
    folder = tmp_path / "bin"
    folder.mkdir()
    monkeypatch.setenv("PATH", str(folder))
    monkeypatch.chdir(tmp_path)
    for joint in (1, 2):
        (tmp_path / f"j{joint}.bin").write_bytes(image(joint))

    def make(*names: str, v1: bool = False) -> Arm:
        made = Arm(SimulatedArm(v1=v1), Bench(folder, *(names or ("dfu-util",))))
        monkeypatch.setattr(devices, "open_bus", lambda *_: made)
        monkeypatch.setattr(devices, "MonotonicClock", lambda: made.arm.clock)
        return made

    return make


def flash(*words: str, joint: int = 1) -> int:
    return main(["flash", "--joint", str(joint), f"j{joint}.bin", "--bus", "linux:1", *words])


def joint(arm: Arm, name: str = "j1") -> Joint:
    made = Joint(arm, arm.arm.clock, PARAMETERS[name])
    made.init()
    return made


def test_a_joint_on_the_bus_is_flashed_and_identified(
    arm: Callable[..., Arm], capsys: pytest.CaptureFixture[str]
) -> None:
    bus = arm()
    assert flash() == 0
    out, err = capsys.readouterr()
    assert err == ""
    first, *others = out.splitlines()
    assert first == "image: j1.bin, j1, version 0.1.0, 5000 bytes"
    assert others == [
        "j1 has protocol 2, firmware 0.1",
        "asked to start its bootloader",
        f"writing to the board in its USB bootloader, serial number {SERIALS['j1']}; "
        "keep it connected",
        "verified: the flash holds the image",
        "confirmed: j1 answers with protocol 2, firmware 0.1",
    ]
    page = (Path(__file__).parents[4] / "docs/firmware.md").read_text()
    (shown,) = re.findall(r"    \$ bioscara flash .*\n    image: \.\.\n((?:    .*\n)*)", page)
    assert [line.strip() for line in shown.splitlines()] == others
    assert bus.tools.flash(SERIALS["j1"]) == image(1)
    assert all(bus.answers(name) for name in SERIALS)


@pytest.mark.parametrize("programs", [("st-flash", "st-info"), ("openocd",)])
def test_a_joint_on_an_st_link_is_confirmed_as_well(
    programs: tuple[str, ...], arm: Callable[..., Arm], capsys: pytest.CaptureFixture[str]
) -> None:
    bus = arm(*programs)
    bus.tools.probe(SERIALS["j2"])
    assert flash("--swd", joint=2) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert "confirmed: j2 answers with protocol 2" in out
    assert bus.tools.flash(SERIALS["j2"]) == image(2)


def test_a_joint_armed_by_another_host_starts_its_bootloader(arm: Callable[..., Arm]) -> None:
    bus = arm()
    joint(bus)
    assert main(["joints", "--bus", "linux:1"]) == 0
    assert flash() == 0
    assert bus.tools.flash(SERIALS["j1"]) == image(1)


def test_an_enabled_joint_is_not_flashed(
    arm: Callable[..., Arm], capsys: pytest.CaptureFixture[str]
) -> None:
    bus = arm("dfu-util", "st-flash", "st-info")
    bus.tools.probe("1")
    engaged = joint(bus)
    engaged.enable()
    assert bus.arm.has_torque("j1")
    for words in ((), ("--swd",)):
        assert flash(*words) == 2
        assert "j1 is enabled, and its load may fall" in capsys.readouterr().err
    assert bus.arm.has_torque("j1")
    assert bus.in_bootloader == set()
    assert bus.tools.flash("1") == b""


def test_a_board_that_cannot_be_the_joint_is_not_flashed(
    arm: Callable[..., Arm], capsys: pytest.CaptureFixture[str]
) -> None:
    bus = arm()
    bus.tools.board(SERIALS["j2"])
    assert flash() == 2
    err = capsys.readouterr().err
    assert f"j1 answers on the bus, so the board in its bootloader, {SERIALS['j2']}, is" in err
    assert bus.tools.flash(SERIALS["j2"]) == b""
    assert bus.answers("j1")


def test_a_joint_without_a_usb_cable_is_reported(
    arm: Callable[..., Arm], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    bus = arm()
    monkeypatch.setattr(Bench, "board", lambda *_: None)
    monkeypatch.setattr("bioscara.flashing.dfu._PATIENCE", 0.0)
    assert flash() == 2
    out, err = capsys.readouterr()
    assert "asked to start its bootloader" in out
    assert "no board is in its bootloader: connect the joint's board by USB" in err
    assert not bus.answers("j1")


def test_a_board_may_appear_before_its_permissions(
    arm: Callable[..., Arm], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("bioscara.flashing.dfu._PAUSE", 0.0)
    bus = arm()
    bus.tools.trouble(early=3)
    assert flash() == 0
    assert bus.tools.calls()[:4] == ["dfu-util -d ,0483:df11 -l"] * 4
    assert bus.tools.flash(SERIALS["j1"]) == image(1)


def test_a_silent_joint_in_its_bootloader_is_flashed_and_confirmed(
    arm: Callable[..., Arm], capsys: pytest.CaptureFixture[str]
) -> None:
    bus = arm()
    joint(bus).start_bootloader()
    assert not bus.answers("j1")
    assert flash() == 0
    out, _ = capsys.readouterr()
    assert "not asked for its bootloader: j1 (0x11), HELLO:" in out
    assert "confirmed: j1 answers" in out


def test_a_joint_whose_last_answer_is_lost_is_flashed_the_second_time(
    arm: Callable[..., Arm], capsys: pytest.CaptureFixture[str]
) -> None:
    bus = arm()
    bus.lost = True
    assert flash() == 2
    assert "j1 (0x11), BOOTLOADER" in capsys.readouterr().err
    assert flash() == 0
    assert bus.tools.flash(SERIALS["j1"]) == image(1)


def test_an_original_joint_needs_its_boot_button(
    arm: Callable[..., Arm], capsys: pytest.CaptureFixture[str]
) -> None:
    bus = arm(v1=True)
    assert flash() == 2
    out, err = capsys.readouterr()
    assert "j1 has protocol 1" in out
    assert "not asked for its bootloader: the original firmware has no request" in out
    assert "hold its BOOT button" in err
    assert bus.answers("j1")


@pytest.mark.parametrize("v1", [False, True])
def test_a_joint_that_did_not_restart_was_not_flashed(
    v1: bool, arm: Callable[..., Arm], capsys: pytest.CaptureFixture[str]
) -> None:
    bus = arm("st-flash", "st-info", v1=v1)
    bus.tools.probe("1")
    assert flash("--swd") == 1
    out, err = capsys.readouterr()
    assert "verified: the flash holds the image" in out
    assert "another board was flashed; check which board the cable is connected to" in err


def test_a_joint_that_stays_silent_after_flashing_is_not_confirmed(
    arm: Callable[..., Arm], capsys: pytest.CaptureFixture[str]
) -> None:
    bus = arm("st-flash", "st-info")
    bus.tools.probe("1")
    bus.arm.set_power("j1", False)
    assert flash("--swd") == 1
    assert "flashed, but not confirmed: j1 (0x11), HELLO" in capsys.readouterr().err


def test_the_arm_in_this_process_has_no_board(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["flash", "--joint", "1", "--bus", "sim"])
    assert "--bus sim has no board to flash" in capsys.readouterr().err


def test_only_a_disabled_joint_of_this_firmware_starts_its_bootloader(
    arm: Callable[..., Arm],
) -> None:
    bus = arm()
    one = joint(bus)
    one.enable()
    with pytest.raises(IncorrectStateError, match="j1: it is enabled, and its load may fall"):
        one.start_bootloader()
    one.disable()
    boot_id = one.hello.boot_id if one.hello else 0
    with pytest.raises(RefusedError) as refused:
        one.session.write(Register.BOOTLOADER, boot_id)
    assert refused.value.reason == Refusal.NOT_DISARMED.name
    assert bus.answers("j1")
    one.start_bootloader()
    assert not bus.answers("j1")
    assert one.version == 0


def test_an_original_joint_has_no_request_for_its_bootloader(arm: Callable[..., Arm]) -> None:
    with pytest.raises(NotSupportedError, match="j1: the request for the bootloader needs"):
        joint(arm(v1=True)).start_bootloader()
