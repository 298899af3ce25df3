"""Timing of the firmware: measured on the emulated board, and its table.

``python tests/emulator/timing.py`` writes the table into docs/firmware.md; with ``--check`` it
writes nothing and fails where a number there is off by more than a fifth.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[1]))

from bioscara.protocol import READ, TRAILER, WRITE, Register
from emulator.board import Board
from emulator.clock import SECOND
from emulator.cortex import Run

TICK = 16 + 29
EVENT, ERROR = 16 + 31, 16 + 32
CORE_HZ = 84_000_000
PERIOD = 1e-3
PAGE = Path(__file__).parents[2] / "docs" / "firmware.md"
BEGIN, END = "<!-- timing: measured by tests/emulator/timing.py -->", "<!-- end of timing -->"
SLACK = 0.2


@dataclass(frozen=True)
class Cost:
    """One row: the operation, its mean and its worst duration [s]."""

    what: str
    mean: float
    worst: float

    def cells(self) -> list[str]:
        return [
            self.what,
            f"{self.mean * CORE_HZ:.0f}",
            f"{self.mean * 1e6:.1f}",
            f"{self.worst * CORE_HZ:.0f}",
            f"{self.worst * 1e6:.1f}",
        ]


def _cost(what: str, runs: list[Run], exceptions: set[int]) -> Cost:
    own = [run.own / SECOND for run in runs if run.exception in exceptions]
    return Cost(what, sum(own) / len(own), max(own))


class Measurement:
    """Runs a joint through its states; every number is of virtual time and repeats exactly."""

    def __init__(self) -> None:
        board = Board(4, position=2.6)
        self.board = board
        self.boot = board.boot()
        board.arm()
        board.run(0.1)
        self.costs = [self._tick("tick, disabled and the bus silent", lambda: board.run(0.2))]
        board.write(Register.SETUP, 20, 20)
        self.costs.append(self._tick("tick, orientation check", board.idle))
        self.costs.append(self._tick("tick, holding", self._poll))
        self.costs.append(self._tick("tick, TRACK at 50 Hz", self._track))
        self.costs.append(self._tick("tick, settings changed in motion", self._change))
        board.idle()
        board.write(Register.STOP, 1)
        board.idle()
        board.write(Register.CLEARFAULT, *board.read(Register.FAULT)[:1])
        board.write(Register.SETUP, 20, 20)
        board.idle()
        board.write(Register.HOME, 1, 11, 30, 10)
        self.costs.append(self._tick("tick, homing", board.idle))
        self.costs.append(self._driver_reset())
        board.machine.cpu.runs.clear()
        self._poll()
        runs = board.machine.cpu.runs
        self.costs.append(_cost("I2C event interrupt", runs, {EVENT}))
        self.costs.append(_cost("I2C error interrupt (NACK after a read)", runs, {ERROR}))
        self.tick_worst = max(cost.worst for cost in self.costs if cost.what.startswith("tick"))
        self.holds = {hertz: self._frames(hertz) for hertz in (100_000, 400_000)}
        self.stack = stack_used(board)

    def _tick(self, what: str, act: Callable[[], object]) -> Cost:
        self.board.machine.cpu.runs.clear()
        act()
        return _cost(what, self.board.machine.cpu.runs, {TICK})

    def _poll(self) -> None:
        for _ in range(10):
            self.board.send(READ[Register.STATE])
            self.board.write(Register.WATCHDOG, 60)
            self.board.run(0.02)

    def _driver_reset(self) -> Cost:
        """All settings of the driver are written anew."""
        board = Board(4, position=0.0)
        board.ready()
        board.machine.cpu.runs.clear()
        board.plant.reset_driver()
        board.run(0.03)
        return _cost("tick, the driver has reset", board.machine.cpu.runs, {TICK})

    def _track(self) -> None:
        board = self.board
        start, begun = board.read(Register.STATE)[0], board.machine.seconds
        while board.machine.seconds < begun + 0.6:
            rpm = -60.0 * min(1.0, 4.0 * (board.machine.seconds - begun))
            start += rpm * 6.0 * 0.02
            board.write(Register.TRACKLOAD, start, rpm)
            board.run(0.02)

    def _change(self) -> None:
        """Several commands for each tick, each of which writes to the driver."""
        board = self.board
        start = board.read(Register.STATE)[0]
        for index in range(30):
            start -= 3.0
            board.write(Register.TRACKLOAD, start, -25.0)
            board.write(Register.SETMAXACCELERATION, 5000.0 + 10.0 * index)
            board.write(Register.SETMAXVELOCITY, 3000.0 + index)
            board.write(Register.SETCURRENT, 20 + index % 2)
            board.write(Register.SETHOLDCURRENT, 20 + index % 3)
            board.run(0.018)

    def _frames(self, hertz: int) -> tuple[float, float]:
        """The longest hold of SCL, and the most in one frame [s]."""
        board = self.board
        board.bus.hertz = hertz
        longest = most = 0.0
        for index in range(60):
            for message, values in (
                (READ[Register.HELLO], ()),
                (READ[Register.STATE], ()),
                (READ[Register.FAULT], ()),
                (WRITE[Register.WATCHDOG], (60,)),
                (WRITE[Register.TRACKLOAD], (0.0, 0.0)),
            ):
                frame, _ = board.frame(message, *values)
                result = board.bus.transfer(board.address, frame, message.answer_size + TRAILER)
                longest = max(longest, *result.holds)
                most = max(most, result.held)
                board.run(17e-6 * index)
        return longest, most


def stack_used(board: Board) -> int:
    """Bytes of the stack that were ever used: words whose start-up pattern is overwritten."""
    bottom, top = board.machine.symbol("stack_bottom"), board.machine.symbol("stack_top")
    painted = board.machine.cpu.peek(bottom, top - bottom)
    paint = painted[:4]
    if paint != paint[:1] * 4:
        raise AssertionError("the stack is full")
    untouched = 0
    while painted[untouched : untouched + 4] == paint:
        untouched += 4
    return top - bottom - untouched


def table(measured: Measurement) -> str:
    """The section of docs/firmware.md."""
    rows = [
        "| what | cycles, mean | us, mean | cycles, worst | us, worst |",
        "| --- | --- | --- | --- | --- |",
        *("| " + " | ".join(cost.cells()) + " |" for cost in measured.costs),
    ]
    size = measured.board.machine.symbol("stack_top") - measured.board.machine.symbol(
        "stack_bottom"
    )
    share = 100 * measured.tick_worst / PERIOD
    lines = [
        *rows,
        "",
        "| what | measured | limit |",
        "| --- | --- | --- |",
        f"| longest tick, share of 1 ms | {share:.1f} % | 45 % |",
        *(
            f"| SCL held, longest / in one write and read, {hertz // 1000} kHz "
            f"| {1e6 * longest:.1f} / {1e6 * most:.1f} us | 10 us |"
            for hertz, (longest, most) in measured.holds.items()
        ),
        f"| stack used | {measured.stack} of {size} bytes | half |",
        f"| from reset to the first answer | {1e3 * measured.boot:.1f} ms | 30 ms |",
    ]
    return "\n".join(lines)


_NUMBER = re.compile(r"\d+(?:\.\d+)?")


def differences(written: str, measured: str) -> list[str]:
    """Return the lines that differ in text, or in a number by more than a fifth."""
    old, new = written.strip().splitlines(), measured.strip().splitlines()
    found = [] if len(old) == len(new) else [f"{len(old)} lines instead of {len(new)}"]
    for was, now in zip(old, new, strict=False):
        same_words = _NUMBER.sub("#", was) == _NUMBER.sub("#", now)
        numbers = zip(_NUMBER.findall(was), _NUMBER.findall(now), strict=False)
        near = all(abs(float(one) - float(two)) <= SLACK * float(two) + 1.0 for one, two in numbers)
        if not (same_words and near):
            found.append(f"{was}\n    is now {now}")
    return found


def main() -> int:
    """Write the table, or check it."""
    parser = argparse.ArgumentParser(prog="python tests/emulator/timing.py")
    parser.add_argument("--check", action="store_true", help="write nothing; fail where it is off")
    measured = table(Measurement())
    page = PAGE.read_text()
    if BEGIN not in page:
        sys.exit(f"{PAGE.name} has no line {BEGIN!r}")
    head, rest = page.split(BEGIN, 1)
    written, tail = rest.split(END, 1)
    if parser.parse_args().check:
        found = differences(written, measured)
        for line in found:
            print(line)  # noqa: T201
        return 1 if found else 0
    PAGE.write_text(f"{head}{BEGIN}\n\n{measured}\n\n{END}{tail}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
