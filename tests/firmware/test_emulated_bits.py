"""The image that is flashed computes the same bits as the simulation.

The calls between the core and its board are recorded on the host, and their answers given to the
core of the image: it has to make the same calls, to the bit.
"""

from __future__ import annotations

import re
import struct
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from emulator.board import IMAGES
from emulator.core import FUNCTIONS, Core
from firmware.host import HOME, NEAR

pytestmark = pytest.mark.usefixtures("images")

FIRMWARE = Path(__file__).parents[2] / "firmware"


@pytest.fixture(scope="module")
def recorder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the program that records."""
    program = tmp_path_factory.mktemp("recorder") / "record"
    sources = [
        FIRMWARE / "tests" / "record.cpp",
        *(FIRMWARE / "joint/src/core").glob("*.cpp"),
        *(FIRMWARE / "sim/src").glob("*.cpp"),
    ]
    flags = ["-std=c++17", "-O1", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror"]
    subprocess.run(["c++", *flags, *map(str, sources), "-o", str(program)], check=True)
    return program


class _Replay:
    """The board, as it was recorded; the calls have to be the same."""

    def __init__(self, joint: int, recording: str) -> None:
        self._events: Iterator[tuple[int, str]] = enumerate(recording.splitlines(), 1)
        functions = {name: getattr(self, name, self._unexpected) for name in FUNCTIONS}
        self.core = Core(IMAGES / f"j{joint}.elf", functions)
        self.count = 0

    def run(self) -> None:
        """Give the core all that was recorded."""
        for number, event in self._events:
            kind, _, answer = event.partition(" ")
            if kind in {"boot", "tick"}:
                getattr(self.core, kind)()
            elif kind == "receive":
                self.core.receive(bytes.fromhex(answer))
            else:
                assert kind == "request", f"line {number}: the image did not do this: {event}"
                self._require(number, event, f":{self.core.request().hex()}")

    def _next(self, kind: str) -> tuple[int, str, str]:
        number, event = next(self._events)
        assert event.startswith(f"{kind} "), f"line {number}: {kind} instead of {event}"
        return number, event, event.split(" ")[1]

    def _require(self, number: int, event: str, said: str) -> None:
        self.count += 1
        assert event.endswith(f" {said}"), f"line {number}: {said} instead of {event}"

    def micros(self, *_: int) -> int:
        return int(self._next("micros")[2], 16)

    def driver_exchange(self, sent: int, received: int, _: int) -> int:
        number, event, answer = self._next("driver")
        self._require(number, event, f":{self.core.memory(sent, 5).hex()}")
        self.core.store(received, bytes.fromhex(answer))
        return 0

    def encoder_exchange(self, command: int, words: int, count: int) -> int:
        number, event, answer = self._next("encoder")
        said = f":{command & 0xFFFF:x} {count:x}"
        if command & 0x8000:
            self._require(number, event, said)
            read = [int(each, 16) for each in answer.split(",")]
            self.core.store(words, struct.pack(f"<{count}H", *read))
        else:
            written = struct.unpack(f"<{count}H", self.core.memory(words, 2 * count))
            self._require(number, event, " ".join([said, *(f"{each:x}" for each in written)]))
        return 0

    def driver_enable(self, on: int, *_: int) -> int:
        number, event, _answer = self._next("enable")
        self._require(number, event, f":{on & 0xFF}")
        return 0

    def _nothing(self, *_: int) -> int:
        return 0

    feed_watchdog = indicate = lock = unlock = bus_errors = _nothing

    def reset_cause(self, *_: int) -> int:
        return int(self._next("reset_cause")[2], 16)

    def boot_id(self, *_: int) -> int:
        return int(self._next("boot_id")[2], 16)

    def _unexpected(self, *_: int) -> int:
        raise AssertionError("a function that the recording does not have")


@pytest.mark.parametrize("joint", [1, 2, 3, 4])
def test_the_image_says_the_same_bits_as_the_simulation(joint: int, recorder: Path) -> None:
    home = HOME[f"j{joint}"]
    command = [str(recorder), str(joint), str(NEAR[f"j{joint}"]), *map(str, home)]
    recording = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    replay = _Replay(joint, recording)
    replay.run()
    assert replay.count > 10_000
    assert len(re.findall("^tick", recording, re.MULTILINE)) > 3000
