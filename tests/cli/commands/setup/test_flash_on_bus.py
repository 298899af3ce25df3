"""Flashing a joint on a bus: the bootloader is requested before, the identity checked after."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from bioscara.bus import Bus, Transaction
from bioscara.drivers import Joint
from bioscara.errors import (
    CommunicationError,
    IncorrectStateError,
    NoAcknowledgeError,
    NotSupportedError,
    RefusedError,
)
from bioscara.flashing import JOINTS, image as image_file
from bioscara.model import load_parameters
from bioscara.protocol import READ, Refusal, Register, ResetCause
from bioscara.robot.connection import devices
from bioscara.sim import FirmwareBus, SimulatedArm
from bioscara.version import __version__
from cli.said import Said
from flashing.images import crc_of, image
from flashing.stand_ins import Bench
from flashing.told import Told

SERIALS = {
    "j1": "3569366E3037",
    "j2": "2071345B3037",
    "j3": "206F337D3037",
    "j4": "354C366A3037",
}
OLDER = 0x1234ABCD
"""CRC-32 of the image that the joints have before they are flashed."""
ONE = f"{crc_of(image(1)):08x}"
PARAMETERS = {joint.name: joint for joint in load_parameters().joints}


class Arm(Bus):
    """An arm whose joints are connected by USB: a joint that leaves its firmware shows up there."""

    def __init__(self, arm: SimulatedArm, tools: Bench) -> None:
        self.arm, self.tools, self._bus = arm, tools, Told(FirmwareBus(arm))
        for joint in PARAMETERS.values():
            self._bus.set_image(joint.address, OLDER)
        self.in_bootloader: set[str] = set()
        self.restarted: set[str] = set()
        self.lost = False

    def transfer(self, transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
        for name, serial in SERIALS.items():
            if serial in self.tools.started() and name not in self.restarted:
                self.restarted.add(name)
                self.in_bootloader.discard(name)
                self.arm.reset(name, ResetCause.SOFTWARE)
                self.has_image(name, self.tools.flash(serial))
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

    def has_image(self, name: str, content: bytes) -> None:
        """Let a joint run this image."""
        self._bus.set_image(PARAMETERS[name].address, crc_of(content))

    def answers(self, name: str) -> bool:
        ping = READ[Register.PING]
        address = PARAMETERS[name].address
        (answer,) = self._bus.transfer((Transaction(address, ping.encode_v1(), 2),))
        return isinstance(answer, bytes)

    def close(self) -> None:
        pass


MakeArm = Callable[..., Arm]


@pytest.fixture
def arm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> MakeArm:
    """Makes an arm that `linux:1` leads to, in virtual time."""
    folder = tmp_path / "bin"
    folder.mkdir()
    monkeypatch.setenv("PATH", str(folder))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(image_file, "__file__", str(tmp_path / "src/bioscara/flashing/image.py"))
    for joint in JOINTS:
        for name in (f"j{joint}.bin", f"bioscara-{__version__}-j{joint}.bin"):
            (tmp_path / name).write_bytes(image(joint))

    def make(*names: str, v1: bool = False) -> Arm:
        made = Arm(
            SimulatedArm(controllers_fed=True, v1=v1), Bench(folder, *(names or ("dfu-util",)))
        )
        monkeypatch.setattr(devices, "open_bus", lambda *_: made)
        monkeypatch.setattr(devices, "MonotonicClock", lambda: made.arm.clock)
        return made

    return make


FLASH = "flash --joint 1 j1.bin --bus linux:1"


def shown_in_documentation(words: str) -> list[str]:
    """Return the output of `bioscara flash WORDS --bus linux:1` on the page, behind the images."""
    page = (Path(__file__).parents[4] / "docs/firmware.md").read_text()
    (shown,) = re.findall(
        rf"    \$ bioscara flash {words} .*\n    image: \.\.\n((?:    .*\n)*)", page
    )
    return [line.strip() for line in shown.splitlines()]


def joint(arm: Arm, name: str = "j1") -> Joint:
    made = Joint(arm, arm.arm.clock, PARAMETERS[name])
    made.init()
    return made


def test_a_joint_on_the_bus_is_flashed_and_identified(arm: MakeArm, said: Said) -> None:
    bus = arm()
    first, *others = said.output(FLASH).splitlines()
    assert first == f"image: j1.bin, j1, version 0.1.0, 5000 bytes, CRC {ONE}"
    assert others == [
        f"j1 has protocol 2, firmware 0.1, image {OLDER:08x}",
        "asked to start its bootloader",
        f"writing to the board in its USB bootloader, serial number {SERIALS['j1']}; "
        "keep it connected",
        "verified: the flash holds the image",
        f"confirmed: j1 answers with protocol 2, firmware 0.1, image {ONE}",
    ]
    assert shown_in_documentation("--joint 1") == others
    assert bus.tools.flash(SERIALS["j1"]) == image(1)
    assert all(bus.answers(name) for name in SERIALS)


@pytest.mark.parametrize("programs", [("st-flash", "st-info"), ("openocd",)])
def test_a_joint_on_an_st_link_is_confirmed_as_well(
    programs: tuple[str, ...], arm: MakeArm, said: Said
) -> None:
    bus = arm(*programs)
    bus.tools.probe(SERIALS["j2"])
    out = said.output("flash --joint 2 j2.bin --bus linux:1 --swd")
    assert "confirmed: j2 answers with protocol 2" in out
    assert bus.tools.flash(SERIALS["j2"]) == image(2)


def test_a_joint_armed_by_another_host_starts_its_bootloader(arm: MakeArm, said: Said) -> None:
    bus = arm()
    joint(bus)
    said.output("joints --bus linux:1")
    said.output(FLASH)
    assert bus.tools.flash(SERIALS["j1"]) == image(1)


def test_an_enabled_joint_is_not_flashed(arm: MakeArm, said: Said) -> None:
    bus = arm("dfu-util", "st-flash", "st-info")
    bus.tools.probe("1")
    engaged = joint(bus)
    engaged.enable()
    assert bus.arm.has_torque("j1")
    for command in (FLASH, f"{FLASH} --swd"):
        assert "j1 is enabled, and its load may fall" in said.failure(command)
    assert bus.arm.has_torque("j1")
    assert bus.in_bootloader == set()
    assert bus.tools.flash("1") == b""


def test_a_board_that_cannot_be_the_joint_is_not_flashed(arm: MakeArm, said: Said) -> None:
    bus = arm()
    bus.tools.board(SERIALS["j2"])
    err = said.failure(FLASH)
    assert f"j1 answers on the bus, so the board in its bootloader, {SERIALS['j2']}, is" in err
    assert bus.tools.flash(SERIALS["j2"]) == b""
    assert bus.answers("j1")


@pytest.fixture
def no_cable(monkeypatch: pytest.MonkeyPatch) -> None:
    """No board appears by USB."""
    monkeypatch.setattr(Bench, "board", lambda *_: None)
    monkeypatch.setattr("bioscara.flashing.dfu._PATIENCE", 0.0)


def test_a_joint_without_a_usb_cable_is_reported(no_cable: None, arm: MakeArm, said: Said) -> None:
    bus = arm()
    status, out, err = said(FLASH)
    assert status == 2
    assert "asked to start its bootloader" in out
    assert "no board is in its bootloader: connect the joint's board by USB" in err
    assert not bus.answers("j1")


def test_a_board_may_appear_before_its_permissions(
    arm: MakeArm, monkeypatch: pytest.MonkeyPatch, said: Said
) -> None:
    monkeypatch.setattr("bioscara.flashing.dfu._PAUSE", 0.0)
    bus = arm()
    bus.tools.trouble(early=3)
    said.output(FLASH)
    assert bus.tools.calls()[:4] == ["dfu-util -d ,0483:df11 -l"] * 4
    assert bus.tools.flash(SERIALS["j1"]) == image(1)


def test_a_silent_joint_in_its_bootloader_is_flashed_and_confirmed(
    arm: MakeArm, said: Said
) -> None:
    bus = arm()
    joint(bus).start_bootloader()
    assert not bus.answers("j1")
    out = said.output(FLASH)
    assert "not asked for its bootloader: j1 (0x11), HELLO:" in out
    assert "confirmed: j1 answers" in out


def test_a_joint_whose_last_answer_is_lost_is_flashed_the_second_time(
    arm: MakeArm, said: Said
) -> None:
    bus = arm()
    bus.lost = True
    assert "j1 (0x11), BOOTLOADER" in said.failure(FLASH)
    said.output(FLASH)
    assert bus.tools.flash(SERIALS["j1"]) == image(1)


def test_an_original_joint_needs_its_boot_button(arm: MakeArm, said: Said) -> None:
    bus = arm(v1=True)
    status, out, err = said(FLASH)
    assert status == 2
    assert "j1 has protocol 1" in out
    assert "not asked for its bootloader: the original firmware has no request" in out
    assert "hold its BOOT button" in err
    assert bus.answers("j1")
    with pytest.raises(NotSupportedError, match="j1: the request for the bootloader needs"):
        joint(bus).start_bootloader()


@pytest.mark.parametrize("v1", [False, True])
def test_a_joint_that_did_not_restart_was_not_flashed(v1: bool, arm: MakeArm, said: Said) -> None:
    bus = arm("st-flash", "st-info", v1=v1)
    bus.tools.probe("1")
    bus.has_image("j1", image(1))
    status, out, err = said(FLASH, "--swd")
    assert status == 1
    assert "verified: the flash holds the image" in out
    assert "another board was flashed; check which board the cable is connected to" in err


def test_a_joint_that_stays_silent_after_flashing_is_not_confirmed(
    arm: MakeArm, said: Said
) -> None:
    bus = arm("st-flash", "st-info")
    bus.tools.probe("1")
    bus.arm.set_power("j1", False)
    err = said.failure(FLASH, "--swd", status=1)
    assert "flashed, but not confirmed: j1 (0x11), HELLO" in err


def test_only_a_disabled_joint_of_this_firmware_starts_its_bootloader(arm: MakeArm) -> None:
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


def test_a_joint_that_has_the_image_is_told_so_and_flashed(arm: MakeArm, said: Said) -> None:
    bus = arm()
    bus.has_image("j1", image(1))
    out = said.output(FLASH)
    assert f"j1 has protocol 2, firmware 0.1, image {ONE}\nj1 already has this image\n" in out
    assert bus.tools.flash(SERIALS["j1"]) == image(1)


def test_a_joint_that_runs_another_image_was_not_flashed(
    arm: MakeArm, monkeypatch: pytest.MonkeyPatch, said: Said
) -> None:
    arm()
    monkeypatch.setattr(Arm, "has_image", lambda *_: None)
    assert (
        f"j1 answers with protocol 2, firmware 0.1, image {OLDER:08x}, not restarted with 0.1, "
        f"image {ONE}: another board was flashed"
    ) in said.failure(FLASH, status=1)


# All joints, one after the other.

ALL = "flash --all --bus linux:1"


def crc(number: int) -> str:
    return f"{crc_of(image(number)):08x}"


def flashed(bus: Arm) -> list[str]:
    return [name for name, serial in SERIALS.items() if bus.tools.flash(serial)]


def test_all_joints_are_flashed_but_the_one_that_has_its_image(arm: MakeArm, said: Said) -> None:
    bus = arm()
    bus.has_image("j2", image(2))
    bus.arm.set_supply(False)  # Supplied by USB.
    lines = said.output(ALL).splitlines()
    assert lines[:4] == [
        f"image: bioscara-{__version__}-j{number}.bin, j{number}, version 0.1.0, 5000 bytes, "
        f"CRC {crc(number)}"
        for number in JOINTS
    ]
    has = "protocol 2, firmware 0.1, image"
    expected = [
        f"j1: {has} {OLDER:08x}: waits for image {crc(1)}",
        f"j2: {has} {crc(2)}: already has its image",
        f"j3: {has} {OLDER:08x}: waits for image {crc(3)}",
        f"j4: {has} {OLDER:08x}: waits for image {crc(4)}",
    ]
    for number in (1, 3, 4):
        serial = SERIALS[f"j{number}"]
        expected += [
            f"j{number}: asked to start its bootloader",
            f"j{number}: writing to the board in its USB bootloader, serial number {serial}; keep "
            "it connected",
            f"j{number}: verified: the flash holds the image",
            f"j{number}: confirmed: j{number} answers with {has} {crc(number)}",
        ]
    expected.append("done: j1, j3, j4 flashed and confirmed")
    assert lines[4:] == expected
    assert shown_in_documentation("--all") == expected
    assert flashed(bus) == ["j1", "j3", "j4"]
    for number in (1, 3, 4):
        assert bus.tools.flash(SERIALS[f"j{number}"]) == image(number)
    # Again: nothing is left to do.
    for number in JOINTS:
        bus.has_image(f"j{number}", image(number))
    calls = len(bus.tools.calls())
    assert said.output(ALL).splitlines()[-1] == (
        "done: each joint has its image, nothing was written"
    )
    assert len(bus.tools.calls()) == calls + 1


def test_a_failure_stops_all_with_what_was_done_and_the_commands_that_go_on(
    arm: MakeArm, monkeypatch: pytest.MonkeyPatch, said: Said
) -> None:
    bus = arm()
    board = Bench.board

    def show(tools: Bench, serial: str) -> None:
        board(tools, serial)
        tools.trouble(spoils=serial == SERIALS["j3"])

    monkeypatch.setattr(Bench, "board", show)
    status, _, error = said(ALL)
    err = error.splitlines()
    assert (status, len(err)) == (1, 2)
    assert "j3 is without working firmware now and does not move" in err[0]
    assert "repeat: bioscara flash --joint 3 --bus linux:1" in err[0]
    assert err[1] == (
        "bioscara: stopped: j1, j2 flashed and confirmed, j3, j4 not; go on with bioscara flash "
        "--joint 3 --bus linux:1, then bioscara flash --all --bus linux:1"
    )
    assert flashed(bus) == ["j1", "j2", "j3"]
    # The commands that it names go on.
    bus.tools.trouble(spoils=False)
    said.output("flash --joint 3 --bus linux:1")
    assert said.output(ALL).splitlines()[-1] == "done: j4 flashed and confirmed"
    assert all(bus.tools.flash(SERIALS[f"j{number}"]) == image(number) for number in JOINTS)


def test_a_board_that_does_not_appear_stops_all(no_cable: None, arm: MakeArm, said: Said) -> None:
    bus = arm()
    status, _, err = said(ALL)
    assert status == 1
    assert "no board is in its bootloader" in err
    assert "stopped: none flashed and confirmed, j1, j2, j3, j4 not; go on with" in err
    assert all(bus.answers(f"j{number}") for number in (2, 3, 4))


def test_another_board_that_appears_in_between_is_not_written(
    arm: MakeArm, monkeypatch: pytest.MonkeyPatch, said: Said
) -> None:
    bus = arm()
    board = Bench.board

    def show(tools: Bench, serial: str) -> None:
        board(tools, serial)
        board(tools, "another")

    monkeypatch.setattr(Bench, "board", show)
    status, _, err = said(ALL)
    assert status == 1
    assert "2 boards are in their bootloader" in err
    assert flashed(bus) == []


def test_with_a_board_in_its_bootloader_nothing_is_begun(arm: MakeArm, said: Said) -> None:
    bus = arm()
    joint(bus, "j3").start_bootloader()
    assert not bus.answers("j3")
    err = said.failure(ALL)
    assert f"a board is in its bootloader already, serial number {SERIALS['j3']}, and of" in err
    assert "press its RESET, or flash it as the joint that it is, as with bioscara flash" in err
    assert flashed(bus) == []
    assert bus.answers("j1")


def test_joints_that_cannot_be_flashed_over_the_bus_are_all_named_before_anything_is_written(
    arm: MakeArm, said: Said
) -> None:
    bus = arm()
    bus.arm.set_power("j1", False)
    engaged = joint(bus, "j4")
    engaged.enable()
    err = said.failure(ALL)
    assert "j1 (0x11), HELLO" in err
    assert "j4 is enabled, and its load may fall" in err
    assert err.endswith("then repeat: bioscara flash --all --bus linux:1\n")
    assert flashed(bus) == []
    assert all(bus.answers(name) for name in ("j2", "j3", "j4"))


def test_original_joints_are_named_with_their_button(arm: MakeArm, said: Said) -> None:
    bus = arm(v1=True)
    err = said.failure(ALL)
    for number in JOINTS:
        assert (
            f"j{number}: the original firmware has no request for the bootloader: connect the "
            "joint's board by USB, hold its BOOT button, press RESET for half a second and release "
            f"BOOT, then bioscara flash --joint {number} --bus linux:1" in err
        )
    assert flashed(bus) == []


def test_a_missing_image_is_named_before_the_bus_is_opened(arm: MakeArm, said: Said) -> None:
    bus = arm()
    Path(f"bioscara-{__version__}-j3.bin").unlink()
    assert "there is no image for j3 here" in said.refusal(ALL)
    assert bus.tools.calls() == []
