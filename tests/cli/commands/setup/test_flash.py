"""Flashing as a user does it: the command line, third-party programs, boards that misbehave."""

from __future__ import annotations

import errno
import re
import signal
from collections.abc import Callable
from pathlib import Path

import pytest

from bioscara.flashing import access, dfu, image as image_file, programmer
from bioscara.flashing.access import RULES
from bioscara.version import __version__
from cli.said import Said
from flashing.images import crc_of, image
from flashing.stand_ins import Bench

ONE, OTHER = "3569366E3037", "2071345B3037"
MakeBench = Callable[..., Bench]


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> MakeBench:
    """Makes a bench; of all programs only the named ones are installed."""
    folder = tmp_path / "bin"
    folder.mkdir()
    monkeypatch.setenv("PATH", str(folder))
    monkeypatch.chdir(tmp_path)
    for joint in (1, 2):
        (tmp_path / f"j{joint}.bin").write_bytes(image(joint))
    return lambda *names: Bench(folder, *names)


@pytest.fixture
def tools(bench: MakeBench) -> Bench:
    """A bench with dfu-util, and one board in its bootloader."""
    made = bench("dfu-util")
    made.board(ONE)
    return made


FLASH = "flash --joint 1 j1.bin"
SWD = "flash --joint 1 --swd j1.bin"
DFU_UTIL, ST_FLASH, OPENOCD = ("dfu-util",), ("st-flash", "st-info"), ("openocd",)
VERIFIED = "verified: the flash holds the image"


def test_an_image_is_written_read_back_and_started(tools: Bench, said: Said) -> None:
    assert said.output(FLASH).splitlines() == [
        f"image: j1.bin, j1, version 0.1.0, 5000 bytes, CRC {crc_of(image(1)):08x}",
        f"writing to the board in its USB bootloader, serial number {ONE}; keep it connected",
        VERIFIED,
    ]
    assert tools.flash(ONE) == image(1)
    assert tools.started() == [ONE]
    board = f"dfu-util -d ,0483:df11 -S {ONE} -a 0"
    assert tools.calls() == [
        "dfu-util -d ,0483:df11 -l",
        f"{board} -s 0x08000000 -D image.bin",
        f"{board} -s 0x08000000:5000 -U readback.bin",
        f"{board} -s 0x08000000:leave",
        "dfu-util -d ,0483:df11 -l",
    ]


@pytest.mark.parametrize("programs", [ST_FLASH, OPENOCD, (*ST_FLASH, *OPENOCD)])
def test_an_image_is_written_through_an_st_link_by_st_flash_if_both_are_installed(
    programs: tuple[str, ...], bench: MakeBench, said: Said
) -> None:
    tools = bench(*programs)
    tools.probe(ONE)
    assert VERIFIED in said.output("flash --joint 2 --swd j2.bin")
    assert tools.flash(ONE) == image(2)
    assert tools.started()[-1] == ONE
    assert any(call.startswith("openocd") for call in tools.calls()) == (programs == OPENOCD)


LARGER = "@Internal Flash  /0x08000000/04*016Kg,01*064Kg,07*128Kg"


@pytest.mark.parametrize(
    ("programs", "connected", "command", "reason"),
    [
        ((), None, FLASH, "dfu-util is not installed: sudo apt install dfu-util\n"),
        ((), None, f"{FLASH} --dfu", "dfu-util is not installed: sudo apt install dfu-util\n"),
        ((), None, SWD, "st-flash is not installed: sudo apt install stlink-tools; or openocd: "
         "sudo apt install openocd\n"),
        (("st-flash",), None, SWD, "sudo apt install stlink-tools"),
        (DFU_UTIL, None, FLASH, "no board is in its bootloader"),
        (DFU_UTIL, None, FLASH, "hold its BOOT button, press RESET"),
        (DFU_UTIL, LARGER, FLASH, "1024 KiB of flash; a uStepper S32 has 256"),
        (ST_FLASH, None, SWD, "there is no ST-Link: connect one"),
        (OPENOCD, None, SWD, "there is no ST-Link: connect one"),
        (ST_FLASH, 0, SWD, "finds no controller: connect SWDIO"),
        (OPENOCD, 0, SWD, "finds no controller: connect SWDIO"),
        (ST_FLASH, 0x433, SWD, "has the device id 0x433"),
        (OPENOCD, 0x433, SWD, "has the device id 0x433"),
    ],
)  # fmt: skip
def test_what_is_missing_or_another_one_is_named_with_its_remedy(
    programs: tuple[str, ...],
    connected: str | int | None,
    command: str,
    reason: str,
    bench: MakeBench,
    said: Said,
) -> None:
    tools = bench(*programs)
    if isinstance(connected, str):
        tools.board(ONE, connected)
    elif connected is not None:
        tools.probe(ONE, connected)
    assert reason in said.failure(command)
    assert tools.flash(ONE) == b""


def test_a_program_that_cannot_be_run_is_named_with_its_path(bench: MakeBench, said: Said) -> None:
    path = bench("dfu-util").folder / "dfu-util"
    path.write_bytes(b"\0garbage")
    assert f"{path} cannot be run: Exec format error; install it" in said.failure(FLASH)


def test_an_empty_serial_number_is_refused(tools: Bench, said: Said) -> None:
    """As from an unset variable of a script: the only board may be another one."""
    assert "--serial: is empty" in said.refusal(FLASH, "--serial", "")
    assert tools.calls() == []


def test_a_wrong_image_is_refused_before_any_program_runs(tools: Bench, said: Said) -> None:
    Path("short.bin").write_bytes(image(1)[:-8])
    Path("j1.elf").write_bytes(b"\x7fELF" + bytes(9000))
    for name, reason in (
        ("j2.bin", "is firmware for j2, not for j1"),
        ("short.bin", "is truncated: it has 4992 bytes and says 5000"),
        ("j1.elf", "is an ELF file"),
        ("nothing.bin", "cannot be read: No such file"),
    ):
        assert f"{name} {reason}" in said.refusal("flash --joint 1", name)
    evil = "a\nverified: \x1b[2J.bin"
    Path(evil).write_bytes(image(2))
    assert "\x1b" not in said.refusal("flash --joint 1", evil)
    assert tools.calls() == []


def test_without_a_file_the_image_of_this_version_is_used(
    tools: Bench, monkeypatch: pytest.MonkeyPatch, said: Said
) -> None:
    checkout = Path("checkout").resolve()
    monkeypatch.setattr(image_file, "__file__", str(checkout / "src/bioscara/flashing/image.py"))
    err = said.refusal("flash --joint 1")
    assert "build it with 'make firmware'" in err
    released = f"bioscara-{__version__}-j1.bin"
    assert f"download {released}" in err
    Path(released).write_bytes(image(1))
    assert f"image: {released}, j1" in said.output("flash --joint 1")
    built = checkout / "firmware/build/j1.bin"
    built.parent.mkdir(parents=True)
    built.write_bytes(image(1))
    tools.trouble(stays=True)
    monkeypatch.setattr(dfu, "_PATIENCE", 0.0)
    out = said.output("flash --joint 1")
    assert f"image: {built}, j1" in out
    assert "press RESET" in out, "it stays in its bootloader"


def looks_after_the_start(tools: Bench) -> int:
    """Return how often the boards were listed after one was started."""
    calls = tools.calls()
    (start,) = (number for number, call in enumerate(calls) if call.endswith(":leave"))
    return sum(call.endswith(" -l") for call in calls[start:])


def test_of_two_boards_one_has_to_be_named(tools: Bench, said: Said) -> None:
    tools.board(OTHER)
    err = said.failure(FLASH)
    assert f"2 boards are in their bootloader: {ONE}, {OTHER}" in err
    assert f"--serial {ONE}" in err
    err = said.failure(FLASH, "--serial", "123")
    assert f"serial number 123; there are: {ONE}, {OTHER}" in err
    assert tools.flash(ONE) == tools.flash(OTHER) == b""
    # The other one stays in its bootloader, and is not waited for.
    assert said.output(FLASH, "--serial", OTHER).splitlines()[-1] == VERIFIED
    assert (tools.flash(ONE), tools.flash(OTHER)) == (b"", image(1))
    assert tools.started() == [OTHER]
    assert looks_after_the_start(tools) == 1


def test_an_inaccessible_second_board_still_requires_a_serial_number(
    tools: Bench, said: Said
) -> None:
    tools.board(OTHER)
    tools.trouble(closed_serial=OTHER)
    err = said.failure(FLASH)
    assert f"besides {ONE} there is a board in its bootloader that cannot be opened" in err
    assert f"--serial {ONE}" in err
    assert tools.flash(ONE) == b""
    assert said.output(FLASH, "--serial", ONE).splitlines()[-1] == VERIFIED
    assert tools.flash(ONE) == image(1)
    assert looks_after_the_start(tools) == 1


def test_of_two_st_links_one_has_to_be_named(bench: MakeBench, said: Said) -> None:
    tools = bench(*ST_FLASH)
    tools.probe(ONE)
    tools.probe(OTHER)
    assert f"there are 2 ST-Links: {ONE}, {OTHER}" in said.failure(SWD)
    said.output(SWD, "--serial", OTHER)
    assert (tools.flash(ONE), tools.flash(OTHER)) == (b"", image(1))


def connected(bench: MakeBench, programs: tuple[str, ...]) -> Bench:
    """A bench with these programs, and a board that each of them finds."""
    tools = bench(*programs)
    tools.board(ONE)
    tools.probe(ONE)
    return tools


BY = pytest.mark.parametrize(
    ("programs", "command"), [(DFU_UTIL, FLASH), (ST_FLASH, SWD), (OPENOCD, SWD)]
)


@BY
def test_no_permission_names_the_rule_and_the_commands(
    programs: tuple[str, ...],
    command: str,
    bench: MakeBench,
    monkeypatch: pytest.MonkeyPatch,
    said: Said,
) -> None:
    connected(bench, programs).trouble(closed="LIBUSB_ERROR_ACCESS")
    err = said.failure(command)
    assert "no permission to use the" in err
    assert f"sudo cp {RULES} /etc/udev/rules.d/ && sudo udevadm control --reload" in err
    monkeypatch.setattr(access, "RULES", Path("/my arm/70.rules"))
    assert "sudo cp '/my arm/70.rules' /etc/udev" in said.failure(command)


def test_a_board_that_cannot_be_opened_names_the_reason(tools: Bench, said: Said) -> None:
    tools.trouble(closed="LIBUSB_ERROR_IO")
    err = said.failure(FLASH)
    assert "LIBUSB_ERROR_IO" in err
    assert "permission" not in err


def test_the_rules_cover_bootloader_and_st_links() -> None:
    rules = RULES.read_text()
    products = re.findall(r'idVendor}=="0483", ATTRS{idProduct}=="([^"]+)", .*uaccess', rules)
    assert products == ["df11", "3748", "374[bdef]", "375[234]"]
    assert int(RULES.name[:2]) < 73  # The place where systemd gives the tag uaccess its meaning.


FAILS = {
    DFU_UTIL: "writing failed: dfu-util ended with 74: dfu-util: Error during special",
    ST_FLASH: "writing failed: st-flash ended with 255: stlink_fwrite_flash() == -1",
    OPENOCD: "writing failed: openocd ended with 1: ** Programming Failed **",
}


@BY
@pytest.mark.parametrize("trouble", ["fails", "spoils"])
def test_an_image_that_fails_verification_is_not_started(
    trouble: str, programs: tuple[str, ...], command: str, bench: MakeBench, said: Said
) -> None:
    tools = connected(bench, programs)
    tools.trouble(**{trouble: True})
    status, out, err = said(command)
    assert status == 1
    assert "verified" not in out
    spoils = "what was read back differs from the image from 0x080003e8 on"
    assert (FAILS[programs] if trouble == "fails" else spoils) in err
    assert "j1 is without working firmware now and does not move" in err
    assert err.rstrip().endswith(f"repeat: bioscara {command}")
    assert tools.calls()[-1] != f"dfu-util -d ,0483:df11 -S {ONE} -a 0 -s 0x08000000:leave"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_an_interruption_reports_the_joint_and_the_command_to_repeat(
    number: signal.Signals, tools: Bench, said: Said
) -> None:
    tools.trouble(interrupt=int(number))
    status, out, err = said(FLASH)
    assert status == 130
    assert "verified" not in out
    assert len(err.splitlines()) == 1
    assert "interrupted; j1 is without working firmware now" in err
    assert "its bootloader is in ROM and still there: it starts automatically" in err
    assert err.rstrip().endswith(f"repeat: bioscara {FLASH}")
    assert tools.started() == []
    assert tools.flash(ONE) == image(1)[:2500]
    del tools.state["interrupt"]
    tools.save()
    said.output(FLASH)
    assert tools.flash(ONE) == image(1)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interruption_of_the_start_says_that_the_image_is_verified(
    number: signal.Signals, tools: Bench, said: Said
) -> None:
    tools.trouble(interrupt_start=int(number))
    status, out, err = said(FLASH)
    assert status == 130
    assert out.splitlines()[-1] == VERIFIED
    assert err == "bioscara: interrupted; j1 has its firmware: press RESET to start it\n"
    assert tools.flash(ONE) == image(1)


def test_a_folder_without_room_for_the_image_is_named(
    tools: Bench, monkeypatch: pytest.MonkeyPatch, said: Said
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(programmer, "LockedFolder", full)
    err = said.failure(FLASH)
    assert "the image cannot be copied: No space left on device; set TMPDIR" in err
    assert "without working firmware" not in err
    assert tools.flash(ONE) == b""


def test_a_board_that_disconnects_before_answering_counts_as_started(
    tools: Bench, said: Said
) -> None:
    tools.trouble(leaves_early=True)
    assert said.output(FLASH).splitlines()[-1] == VERIFIED
