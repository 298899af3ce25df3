"""Flashing as a user does it: the command line, third-party programs, boards that misbehave."""

from __future__ import annotations

import errno
import re
import signal
from collections.abc import Callable
from pathlib import Path

import pytest

from bioscara.cli import main
from bioscara.flashing import access, dfu, image as image_file, programmer
from bioscara.flashing.access import RULES
from bioscara.version import __version__
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


def swd(bench: MakeBench, program: str) -> Bench:
    """A bench with one program for an ST-Link."""
    return bench("st-flash", "st-info") if program == "st-flash" else bench("openocd")


def test_an_image_is_written_read_back_and_started(
    bench: MakeBench, capsys: pytest.CaptureFixture[str]
) -> None:
    tools = bench("dfu-util")
    tools.board(ONE)
    assert main(["flash", "--joint", "1", "j1.bin"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert out.splitlines() == [
        f"image: j1.bin, j1, version 0.1.0, 5000 bytes, CRC {crc_of(image(1)):08x}",
        f"writing to the board in its USB bootloader, serial number {ONE}; keep it connected",
        "verified: the flash holds the image",
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


@pytest.mark.parametrize("program", ["st-flash", "openocd"])
def test_an_image_is_written_through_an_st_link(
    program: str, bench: MakeBench, capsys: pytest.CaptureFixture[str]
) -> None:
    tools = swd(bench, program)
    tools.probe(ONE)
    assert main(["flash", "--joint", "2", "--swd", "j2.bin"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert "verified: the flash holds the image" in out
    assert tools.flash(ONE) == image(2)
    assert tools.started()[-1] == ONE


def test_st_flash_is_preferred_if_both_are_installed(bench: MakeBench) -> None:
    tools = bench("st-flash", "st-info", "openocd")
    tools.probe(ONE)
    assert main(["flash", "--joint", "2", "--swd", "j2.bin"]) == 0
    assert not [call for call in tools.calls() if call.startswith("openocd")]


@pytest.mark.parametrize(
    ("words", "remedy"),
    [
        ([], "dfu-util is not installed: sudo apt install dfu-util"),
        (["--dfu"], "dfu-util is not installed: sudo apt install dfu-util"),
        (
            ["--swd"],
            "st-flash is not installed: sudo apt install stlink-tools; or openocd: sudo apt "
            "install openocd",
        ),
    ],
)
def test_a_missing_program_is_named_with_its_package(
    words: list[str], remedy: str, bench: MakeBench, capsys: pytest.CaptureFixture[str]
) -> None:
    bench()
    assert main(["flash", "--joint", "1", "j1.bin", *words]) == 2
    assert capsys.readouterr().err == f"bioscara: {remedy}\n"


def test_st_flash_needs_its_companion(bench: MakeBench, capsys: pytest.CaptureFixture[str]) -> None:
    bench("st-flash").probe(ONE)
    assert main(["flash", "--joint", "1", "--swd", "j1.bin"]) == 2
    assert "sudo apt install stlink-tools" in capsys.readouterr().err


def test_a_program_that_cannot_be_run_is_named_with_its_path(
    bench: MakeBench, capsys: pytest.CaptureFixture[str]
) -> None:
    path = bench("dfu-util").folder / "dfu-util"
    path.write_bytes(b"\0garbage")
    assert main(["flash", "--joint", "1", "j1.bin"]) == 2
    assert f"{path} cannot be run: Exec format error; install it" in capsys.readouterr().err


def test_an_empty_serial_number_is_refused(
    bench: MakeBench, capsys: pytest.CaptureFixture[str]
) -> None:
    """As from an unset variable of a script: the only board may be another one."""
    tools = bench("dfu-util")
    tools.board(ONE)
    with pytest.raises(SystemExit, match="2"):
        main(["flash", "--joint", "1", "j1.bin", "--serial", ""])
    assert "--serial: is empty" in capsys.readouterr().err
    assert tools.calls() == []


def test_a_wrong_image_is_refused_before_any_program_runs(
    bench: MakeBench, capsys: pytest.CaptureFixture[str]
) -> None:
    tools = bench("dfu-util")
    tools.board(ONE)
    Path("short.bin").write_bytes(image(1)[:-8])
    Path("j1.elf").write_bytes(b"\x7fELF" + bytes(9000))
    for name, reason in (
        ("j2.bin", "is firmware for j2, not for j1"),
        ("short.bin", "is truncated: it has 4992 bytes and says 5000"),
        ("j1.elf", "is an ELF file"),
        ("nothing.bin", "cannot be read: No such file"),
    ):
        assert main(["flash", "--joint", "1", name]) == 2
        out, err = capsys.readouterr()
        assert out == ""
        assert f"{name} {reason}" in err
    assert tools.calls() == []


def test_control_characters_in_a_name_are_escaped(
    bench: MakeBench, capsys: pytest.CaptureFixture[str]
) -> None:
    bench("dfu-util")
    Path("a\nverified: \x1b[2J.bin").write_bytes(image(2))
    assert main(["flash", "--joint", "1", "a\nverified: \x1b[2J.bin"]) == 2
    _, err = capsys.readouterr()
    assert len(err.splitlines()) == 1
    assert "\x1b" not in err


def test_without_a_file_the_image_of_this_version_is_used(
    bench: MakeBench, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    tools = bench("dfu-util")
    tools.board(ONE)
    checkout = Path("checkout").resolve()
    monkeypatch.setattr(image_file, "__file__", str(checkout / "src/bioscara/flashing/image.py"))
    assert main(["flash", "--joint", "1"]) == 2
    err = capsys.readouterr().err
    assert "build it with 'make firmware'" in err
    released = f"bioscara-{__version__}-j1.bin"
    assert f"download {released}" in err
    Path(released).write_bytes(image(1))
    assert main(["flash", "--joint", "1"]) == 0
    assert f"image: {released}, j1" in capsys.readouterr().out
    built = checkout / "firmware/build/j1.bin"
    built.parent.mkdir(parents=True)
    built.write_bytes(image(1))
    tools.trouble(stays=True)
    monkeypatch.setattr(dfu, "_PATIENCE", 0.0)
    assert main(["flash", "--joint", "1"]) == 0
    assert f"image: {built}, j1" in capsys.readouterr().out


def test_no_board_in_its_bootloader_says_how_to_start_it(
    bench: MakeBench, capsys: pytest.CaptureFixture[str]
) -> None:
    bench("dfu-util")
    assert main(["flash", "--joint", "1", "j1.bin"]) == 2
    err = capsys.readouterr().err
    assert "no board is in its bootloader" in err
    assert "hold its BOOT button, press RESET" in err


def test_of_two_boards_one_has_to_be_named(
    bench: MakeBench, capsys: pytest.CaptureFixture[str]
) -> None:
    tools = bench("dfu-util")
    tools.board(ONE)
    tools.board(OTHER)
    assert main(["flash", "--joint", "1", "j1.bin"]) == 2
    err = capsys.readouterr().err
    assert f"2 boards are in their bootloader: {ONE}, {OTHER}" in err
    assert f"--serial {ONE}" in err
    assert main(["flash", "--joint", "1", "j1.bin", "--serial", "123"]) == 2
    assert f"serial number 123; there are: {ONE}, {OTHER}" in capsys.readouterr().err
    assert tools.flash(ONE) == tools.flash(OTHER) == b""
    assert main(["flash", "--joint", "1", "j1.bin", "--serial", OTHER]) == 0
    assert (tools.flash(ONE), tools.flash(OTHER)) == (b"", image(1))
    assert tools.started() == [OTHER]
    # The other one stays in its bootloader, and is not waited for.
    assert capsys.readouterr().out.splitlines()[-1] == "verified: the flash holds the image"
    assert looks_after_the_start(tools) == 1


def looks_after_the_start(tools: Bench) -> int:
    """Return how often the boards were listed after one was started."""
    calls = tools.calls()
    (start,) = (number for number, call in enumerate(calls) if call.endswith(":leave"))
    return sum(call.endswith(" -l") for call in calls[start:])


def test_an_inaccessible_second_board_still_requires_a_serial_number(
    bench: MakeBench, capsys: pytest.CaptureFixture[str]
) -> None:
    tools = bench("dfu-util")
    tools.board(ONE)
    tools.board(OTHER)
    tools.trouble(closed_serial=OTHER)
    assert main(["flash", "--joint", "1", "j1.bin"]) == 2
    err = capsys.readouterr().err
    assert f"besides {ONE} there is a board in its bootloader that cannot be opened" in err
    assert f"--serial {ONE}" in err
    assert tools.flash(ONE) == b""
    assert main(["flash", "--joint", "1", "j1.bin", "--serial", ONE]) == 0
    assert tools.flash(ONE) == image(1)
    assert capsys.readouterr().out.splitlines()[-1] == "verified: the flash holds the image"
    assert looks_after_the_start(tools) == 1


def test_of_two_st_links_one_has_to_be_named(
    bench: MakeBench, capsys: pytest.CaptureFixture[str]
) -> None:
    tools = bench("st-flash", "st-info")
    tools.probe(ONE)
    tools.probe(OTHER)
    assert main(["flash", "--joint", "1", "--swd", "j1.bin"]) == 2
    assert f"there are 2 ST-Links: {ONE}, {OTHER}" in capsys.readouterr().err
    assert main(["flash", "--joint", "1", "--swd", "j1.bin", "--serial", OTHER]) == 0
    assert (tools.flash(ONE), tools.flash(OTHER)) == (b"", image(1))


def test_another_board_is_refused(bench: MakeBench, capsys: pytest.CaptureFixture[str]) -> None:
    tools = bench("dfu-util")
    tools.board(ONE, "@Internal Flash  /0x08000000/04*016Kg,01*064Kg,07*128Kg")
    assert main(["flash", "--joint", "1", "j1.bin"]) == 2
    assert "1024 KiB of flash; a uStepper S32 has 256" in capsys.readouterr().err
    assert tools.flash(ONE) == b""


@pytest.mark.parametrize("program", ["st-flash", "openocd"])
@pytest.mark.parametrize(
    ("chip", "reason"),
    [(0, "finds no controller: connect SWDIO"), (0x433, "has the device id 0x433")],
)
def test_another_controller_on_the_st_link_is_refused(
    program: str,
    chip: int,
    reason: str,
    bench: MakeBench,
    capsys: pytest.CaptureFixture[str],
) -> None:
    tools = swd(bench, program)
    tools.probe(ONE, chip)
    assert main(["flash", "--joint", "1", "--swd", "j1.bin"]) == 2
    assert reason in capsys.readouterr().err
    assert tools.flash(ONE) == b""


@pytest.mark.parametrize("program", ["st-flash", "openocd"])
def test_no_st_link_says_what_to_connect(
    program: str, bench: MakeBench, capsys: pytest.CaptureFixture[str]
) -> None:
    swd(bench, program)
    assert main(["flash", "--joint", "1", "--swd", "j1.bin"]) == 2
    assert "there is no ST-Link: connect one" in capsys.readouterr().err


@pytest.mark.parametrize("program", ["dfu-util", "st-flash", "openocd"])
def test_no_permission_names_the_rule_and_the_commands(
    program: str, bench: MakeBench, capsys: pytest.CaptureFixture[str]
) -> None:
    tools = bench("dfu-util") if program == "dfu-util" else swd(bench, program)
    tools.board(ONE)
    tools.probe(ONE)
    tools.trouble(closed="LIBUSB_ERROR_ACCESS")
    words = [] if program == "dfu-util" else ["--swd"]
    assert main(["flash", "--joint", "1", "j1.bin", *words]) == 2
    err = capsys.readouterr().err
    assert "no permission to use the" in err
    assert f"sudo cp {RULES} /etc/udev/rules.d/ && sudo udevadm control --reload" in err


def test_the_command_for_the_rule_is_quoted(
    bench: MakeBench, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    tools = bench("dfu-util")
    tools.board(ONE)
    tools.trouble(closed="LIBUSB_ERROR_ACCESS")
    monkeypatch.setattr(access, "RULES", Path("/my arm/70.rules"))
    assert main(["flash", "--joint", "1", "j1.bin"]) == 2
    assert "sudo cp '/my arm/70.rules' /etc/udev" in capsys.readouterr().err


def test_a_board_that_cannot_be_opened_names_the_reason(
    bench: MakeBench, capsys: pytest.CaptureFixture[str]
) -> None:
    tools = bench("dfu-util")
    tools.board(ONE)
    tools.trouble(closed="LIBUSB_ERROR_IO")
    assert main(["flash", "--joint", "1", "j1.bin"]) == 2
    err = capsys.readouterr().err
    assert "LIBUSB_ERROR_IO" in err
    assert "permission" not in err


def test_the_rules_cover_bootloader_and_st_links() -> None:
    rules = RULES.read_text()
    products = re.findall(r'idVendor}=="0483", ATTRS{idProduct}=="([^"]+)", .*uaccess', rules)
    assert products == ["df11", "3748", "374[bdef]", "375[234]"]
    assert int(RULES.name[:2]) < 73  # The place where systemd gives the tag uaccess its meaning.


@pytest.mark.parametrize("program", ["dfu-util", "st-flash", "openocd"])
@pytest.mark.parametrize("trouble", ["fails", "spoils"])
def test_an_image_that_fails_verification_is_not_started(
    trouble: str, program: str, bench: MakeBench, capsys: pytest.CaptureFixture[str]
) -> None:
    tools = bench("dfu-util") if program == "dfu-util" else swd(bench, program)
    tools.board(ONE)
    tools.probe(ONE)
    tools.trouble(**{trouble: True})
    words = [] if program == "dfu-util" else ["--swd"]
    asked = ["flash", "--joint", "1", "j1.bin", *words]
    assert main(asked) == 1
    out, err = capsys.readouterr()
    assert "verified" not in out
    fails = {
        "dfu-util": "writing failed: dfu-util ended with 74: dfu-util: Error during special",
        "st-flash": "writing failed: st-flash ended with 255: stlink_fwrite_flash() == -1",
        "openocd": "writing failed: openocd ended with 1: ** Programming Failed **",
    }
    spoils = "what was read back differs from the image from 0x080003e8 on"
    reason = fails[program] if trouble == "fails" else spoils
    assert reason in err
    assert "j1 is without working firmware now and does not move" in err
    assert err.rstrip().endswith("repeat: bioscara " + " ".join(asked))
    assert tools.calls()[-1] != f"dfu-util -d ,0483:df11 -S {ONE} -a 0 -s 0x08000000:leave"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_an_interruption_reports_the_joint_and_the_command_to_repeat(
    number: signal.Signals, bench: MakeBench, capsys: pytest.CaptureFixture[str]
) -> None:
    tools = bench("dfu-util")
    tools.board(ONE)
    tools.trouble(interrupt=int(number))
    assert main(["flash", "--joint", "1", "j1.bin"]) == 130
    out, err = capsys.readouterr()
    assert "verified" not in out
    assert len(err.splitlines()) == 1
    assert "interrupted; j1 is without working firmware now" in err
    assert "its bootloader is in ROM and still there: it starts automatically" in err
    assert err.rstrip().endswith("repeat: bioscara flash --joint 1 j1.bin")
    assert tools.started() == []
    assert tools.flash(ONE) == image(1)[:2500]
    del tools.state["interrupt"]
    tools.save()
    assert main(["flash", "--joint", "1", "j1.bin"]) == 0
    assert tools.flash(ONE) == image(1)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interruption_of_the_start_says_that_the_image_is_verified(
    number: signal.Signals, bench: MakeBench, capsys: pytest.CaptureFixture[str]
) -> None:
    tools = bench("dfu-util")
    tools.board(ONE)
    tools.trouble(interrupt_start=int(number))
    assert main(["flash", "--joint", "1", "j1.bin"]) == 130
    out, err = capsys.readouterr()
    assert out.splitlines()[-1] == "verified: the flash holds the image"
    assert err == "bioscara: interrupted; j1 has its firmware: press RESET to start it\n"
    assert tools.flash(ONE) == image(1)


def test_a_folder_without_room_for_the_image_is_named(
    bench: MakeBench, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    tools = bench("dfu-util")
    tools.board(ONE)

    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(programmer, "LockedFolder", full)
    assert main(["flash", "--joint", "1", "j1.bin"]) == 2
    err = capsys.readouterr().err
    assert "the image cannot be copied: No space left on device; set TMPDIR" in err
    assert "without working firmware" not in err
    assert tools.flash(ONE) == b""


def test_a_board_that_disconnects_before_answering_counts_as_started(
    bench: MakeBench, capsys: pytest.CaptureFixture[str]
) -> None:
    tools = bench("dfu-util")
    tools.board(ONE)
    tools.trouble(leaves_early=True)
    assert main(["flash", "--joint", "1", "j1.bin"]) == 0
    out, err = capsys.readouterr()
    assert (out.splitlines()[-1], err) == ("verified: the flash holds the image", "")


def test_a_board_that_stays_in_its_bootloader_needs_its_reset_button(
    bench: MakeBench, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    tools = bench("dfu-util")
    tools.board(ONE)
    tools.trouble(stays=True)
    monkeypatch.setattr(dfu, "_PATIENCE", 0.0)
    assert main(["flash", "--joint", "1", "j1.bin"]) == 0
    assert "press RESET" in capsys.readouterr().out
