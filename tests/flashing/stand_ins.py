"""Programs that stand in for dfu-util 0.11, stlink-tools 1.7.0 and OpenOCD 0.12.

Words, output and exit codes are those of the real programs: seen on Debian 12 as far as no device
is needed, and read from the sources of these versions where one is. A word that the real program
does not know ends the stand-in too. The boards are in ``state.json`` in the same folder.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

PROGRAM = """#!{python}
import sys
sys.path.insert(0, {tests!r})
from flashing import stand_ins
stand_ins.{function}(sys.argv[1:], {folder!r})
"""
NAMES = {
    "dfu-util": "dfu_util",
    "st-flash": "st_flash",
    "st-info": "st_info",
    "openocd": "openocd",
}
STM32F401RC = "@Internal Flash  /0x08000000/04*016Kg,01*064Kg,01*128Kg"


class Bench:
    """A folder with stand-ins on the PATH, and boards that they see.

    Args:
        folder: An empty one.
        names: Programs that are installed.
    """

    def __init__(self, folder: Path, *names: str) -> None:
        self.folder = folder
        self.state: dict[str, Any] = {"boards": [], "probes": []}
        os.mkfifo(folder / "forever")
        for name in names:
            path = folder / name
            path.write_text(
                PROGRAM.format(
                    python=sys.executable,
                    tests=str(Path(__file__).parents[1]),
                    function=NAMES[name],
                    folder=str(folder),
                )
            )
            path.chmod(0o755)
        self.save()

    def board(self, serial: str, name: str = STM32F401RC) -> None:
        """Connect a board that is in its USB bootloader."""
        self.state["boards"].append({"serial": serial, "name": name})
        self.save()

    def probe(self, serial: str, chip: int = 0x423) -> None:
        """Connect an ST-Link with a controller of this device id; 0 for none."""
        self.state["probes"].append({"serial": serial, "chip": chip})
        self.save()

    def trouble(self, **what: object) -> None:
        """Set the fault to simulate."""
        self.state.update(what)
        self.save()

    def save(self) -> None:
        """Let the stand-ins see the state."""
        (self.folder / "state.json").write_text(json.dumps(self.state))

    def flash(self, serial: str) -> bytes:
        """Return the content of a board's flash."""
        path = self.folder / f"{serial}.flash"
        return path.read_bytes() if path.exists() else b""

    def calls(self) -> list[str]:
        """Return the command lines so far."""
        path = self.folder / "calls"
        return path.read_text().splitlines() if path.exists() else []

    def started(self) -> list[str]:
        """Return the boards that were started."""
        return _started(str(self.folder))


def _begin(name: str, words: list[str], folder: str) -> dict[str, Any]:
    with (Path(folder) / "calls").open("a") as file:
        file.write(" ".join((name, *words)) + "\n")
    state: dict[str, Any] = json.loads((Path(folder) / "state.json").read_text())
    return state


def _started(folder: str) -> list[str]:
    path = Path(folder) / "started"
    return path.read_text().splitlines() if path.exists() else []


def _looks(folder: str) -> int:
    calls = (Path(folder) / "calls").read_text().splitlines()
    return sum(call.endswith(" -l") for call in calls)


def _start(folder: str, serial: str) -> None:
    with (Path(folder) / "started").open("a") as file:
        file.write(serial + "\n")


def _store(state: dict[str, Any], path: Path, content: bytes) -> None:
    """Write a flash, as far as it gets."""
    if state.get("spoils"):
        content = content[:1000] + bytes((content[1000] ^ 1,)) + content[1001:]
    if "interrupt" in state:
        path.write_bytes(content[: len(content) // 2])
        os.kill(os.getppid(), state["interrupt"])
        os.read(os.open(path.parent / "forever", os.O_RDWR), 1)
    path.write_bytes(content)


def _say(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def _warn(text: str) -> None:
    sys.stderr.write(text + "\n")


DFU_BANNER = """dfu-util 0.11

Copyright 2005-2009 Weston Schmidt, Harald Welte and OpenMoko Inc.
Copyright 2010-2021 Tormod Volden and Stefan Schmidt
This program is Free Software and has ABSOLUTELY NO WARRANTY
Please report bugs to http://sourceforge.net/p/dfu-util/tickets/
"""
DFU_OPEN = """Opening DFU capable USB device...
Device ID 0483:df11
Device DFU version 011a
Claiming USB DFU Interface...
Setting Alternate Interface #0 ...
Determining device status...
DFU state(2) = dfuIDLE, status(0) = No error condition is present
DFU mode device DFU version 011a
Device returned transfer size 2048
DfuSe interface name: "Internal Flash  "
"""


def dfu_util(words: list[str], folder: str) -> None:
    """Stand in for dfu-util."""
    state = _begin("dfu-util", words, folder)
    options: dict[str, str] = {}
    rest = list(words)
    while rest:
        word = rest.pop(0)
        if word == "-l":
            options[word] = ""
        elif word in ("-d", "-S", "-a", "-s", "-D", "-U"):
            options[word] = rest.pop(0)
        else:
            _warn(f"dfu-util: unrecognized option '{word}'")
            sys.exit(64)
    _say(DFU_BANNER)
    assert options["-d"] == ",0483:df11"
    boards = state["boards"]
    if not state.get("stays"):
        boards = [each for each in boards if each["serial"] not in _started(folder)]
    if "-l" in options and _looks(folder) <= state.get("early", 0):
        state["closed"] = "LIBUSB_ERROR_ACCESS"
    if "closed" in state:
        for number, _ in enumerate(boards):
            _warn(
                f"dfu-util: Cannot open DFU device 0483:df11 found on devnum {5 + number} "
                f"({state['closed']})"
            )
        boards = []
    if "-l" in options:
        if "closed_serial" in state:
            boards = [each for each in boards if each["serial"] != state["closed_serial"]]
            _warn(
                "dfu-util: Cannot open DFU device 0483:df11 found on devnum 7 (LIBUSB_ERROR_ACCESS)"
            )
        _list(boards)
        sys.exit(0)
    boards = [each for each in boards if each["serial"] == options.get("-S", each["serial"])]
    if "-D" in options:
        _warn("dfu-util: Warning: Invalid DFU suffix signature")
        _warn("dfu-util: A valid DFU suffix will be required in a future dfu-util release")
    if len(boards) != 1 or "-a" not in options:
        _warn(
            "dfu-util: No DFU capable USB device available"
            if not boards
            else "dfu-util: More than one DFU capable USB device found! Try `--list' and specify "
            "the serial number or disconnect all but one device"
        )
        sys.exit(74)
    _say(DFU_OPEN)
    _dfuse(state, options, Path(folder), boards[0]["serial"])


def _list(boards: list[dict[str, str]]) -> None:
    for number, board in enumerate(boards):
        for alt, name in (
            (3, "@Device Feature/0xFFFF0000/01*004 e"),
            (2, "@OTP Memory /0x1FFF7800/01*512 e,01*016 e"),
            (1, "@Option Bytes  /0x1FFFC000/01*016 e"),
            (0, board["name"]),
        ):
            _say(
                f"Found DFU: [0483:df11] ver=2200, devnum={5 + number}, cfg=1, intf=0, "
                f'path="1-1.{1 + number}", alt={alt}, name="{name}", '
                f'serial="{board["serial"]}"'
            )


def _dfuse(state: dict[str, Any], options: dict[str, str], folder: Path, serial: str) -> None:
    address, *modifiers = options["-s"].split(":")
    assert address == "0x08000000"
    flash = folder / f"{serial}.flash"
    if "-D" in options:
        content = Path(options["-D"]).read_bytes()
        _say(f"Downloading element to address = 0x08000000, size = {len(content)}")
        if state.get("fails"):
            _warn(
                'dfu-util: Error during special command "ERASE_PAGE" download: 0 (LIBUSB_ERROR_IO)'
            )
            sys.exit(74)
        _store(state, flash, content)
        bar = f"[=========================] 100% {len(content):12} bytes"
        _say(f"\rErase   \t{bar}\nErase    done.\n\rDownload\t{bar}\nDownload done.")
        _say("File downloaded successfully")
    elif "-U" in options:
        if Path(options["-U"]).exists():
            _warn(f"dfu-util: Cannot open file {options['-U']} for writing: File exists")
            sys.exit(73)
        (length,) = map(int, modifiers)
        Path(options["-U"]).write_bytes(flash.read_bytes()[:length])
        _say(f"Upload done.\nReceived a total of {length} bytes")
    else:
        assert modifiers == ["leave"]
        if "interrupt_start" in state:
            os.kill(os.getppid(), state["interrupt_start"])
            os.read(os.open(folder / "forever", os.O_RDWR), 1)
        _say("DfuSe command mode\nSubmitting leave request...")
        _start(str(folder), serial)
        if state.get("leaves_early"):
            _warn("dfu-util: Error during download get_status (LIBUSB_ERROR_NO_DEVICE)")
            sys.exit(74)


def st_info(words: list[str], folder: str) -> None:
    """Stand in for st-info."""
    state = _begin("st-info", words, folder)
    assert words == ["--probe"]
    probes = state["probes"]
    if "closed" in state:
        for _ in probes:
            _warn("ERROR usb.c: Could not open USB device 0x0483:0x3748, access error.")
        probes = []
    _say(f"Found {len(probes)} stlink programmers")
    for probe in probes:
        found = probe["chip"] != 0
        _say(f"  version:    V2J37S7\n  serial:     {probe['serial']}")
        _say(f"  flash:      {262144 * found} (pagesize: {16384 * found})")
        _say(f"  sram:       {65536 * found}\n  chipid:     {probe['chip']:#06x}")
        _say(f"  descr:      {'F401xB/C' if found else 'unknown device'}")


def st_flash(words: list[str], folder: str) -> None:
    """Stand in for st-flash."""
    state = _begin("st-flash", words, folder)
    option, serial, action, *rest = words
    assert option == "--serial"
    _warn("st-flash 1.7.0")
    if serial not in [each["serial"] for each in state["probes"]]:
        _warn("2026-11-22T18:53:30 WARN usb.c: Couldn't find any ST-Link devices")
        sys.exit(255)
    flash = Path(folder) / f"{serial}.flash"
    if action == "write":
        name, address = rest
        assert address == "0x8000000"
        if state.get("fails"):
            _warn("2026-11-22T18:53:30 WARN common.c: Flash memory is write protected")
            _warn("stlink_fwrite_flash() == -1")
            sys.exit(255)
        _store(state, flash, Path(name).read_bytes())
        _warn("2026-11-22T18:53:31 INFO common.c: Flash written and verified! jolly good!")
    elif action == "read":
        name, address, length = rest
        assert address == "0x8000000"
        Path(name).write_bytes(flash.read_bytes()[: int(length, 16)])
    else:
        assert (action, rest) == ("reset", [])
        _start(folder, serial)


OPENOCD_BANNER = """Open On-Chip Debugger 0.12.0
Licensed under GNU GPL v2
For bug reports, read
\thttp://openocd.org/doc/doxygen/bugs.html
Info : clock speed 2000 kHz"""


def openocd(words: list[str], folder: str) -> None:
    """Stand in for openocd."""
    state = _begin("openocd", words, folder)
    pairs = list(zip(words[::2], words[1::2], strict=True))
    files = [value for option, value in pairs if option == "-f"]
    assert files == ["interface/stlink.cfg", "target/stm32f4x.cfg"]
    commands = [value for option, value in pairs if option == "-c"]
    assert len(files) + len(commands) == len(pairs)
    assert commands[-1] == "shutdown"
    _warn(OPENOCD_BANNER)
    probes = state["probes"]
    if commands[0].startswith("adapter serial "):
        serial = commands.pop(0).removeprefix("adapter serial ")
        probes = [each for each in probes if each["serial"] == serial]
    if "closed" in state:
        _warn("Error: libusb_open() failed with LIBUSB_ERROR_ACCESS")
        probes = []
    if not probes:
        _warn("Error: open failed")
        sys.exit(1)
    probe = probes[0]
    _warn("Info : STLINK V2J37S7 (API v2) VID:PID 0483:3748")
    if probe["chip"] == 0:
        _warn("Error: init mode failed (unable to connect to the target)")
        sys.exit(1)
    flash = Path(folder) / f"{probe['serial']}.flash"
    for command in commands[:-1]:
        _openocd_step(state, command, probe, flash)
    _warn("shutdown command invoked")


def _openocd_step(state: dict[str, Any], command: str, probe: dict[str, Any], flash: Path) -> None:
    match command.split():
        case ["init"] | ["reset", "halt"]:
            pass
        case ["flash", "probe", "0"]:
            _warn(f"Info : device id = {0x10006000 | probe['chip']:#010x}")
            _warn("Info : flash size = 256 KiB")
        case ["program", name, "0x8000000"]:
            _warn("** Programming Started **")
            if state.get("fails"):
                _warn("Error: stm32x device protected\n** Programming Failed **")
                sys.exit(1)
            _store(state, flash, Path(name).read_bytes())
            _warn("** Programming Finished **")
        case ["dump_image", name, "0x8000000", length]:
            Path(name).write_bytes(flash.read_bytes()[: int(length, 16)])
        case ["reset", "run"]:
            _start(str(flash.parent), probe["serial"])
        case _:
            _warn(f'invalid command name "{command}"')
            sys.exit(1)
