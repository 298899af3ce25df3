"""The line that names the arm, and the note on a bus that leaves a late computer little time."""

from __future__ import annotations

import re

import pytest

from bioscara.cli.opened_arm import introduce
from bioscara.cli.parser import Options
from simulated import simulated_robot


def introduced(bus: str, rate: int | None) -> tuple[list[str], float]:
    lines: list[str] = []
    with simulated_robot(rate=rate).robot as robot:
        introduce(robot, Options(bus=bus), lines.append)
        return lines, robot.bus_share


def test_a_rate_that_leaves_little_is_named_with_one_that_leaves_a_fifth() -> None:
    (arm, note), share = introduced("linux:1", 106)
    assert arm == "arm: simulated"
    assert 0.8 < share < 1.0
    told = re.fullmatch(r"note: at 106 Hz the bus leaves (\d+)% of .*; .* --rate (\d+) .*", note)
    assert told is not None, note
    assert int(told[1]) == round(100.0 * (1.0 - share))
    lines, slower = introduced("linux:1", int(told[2]))
    assert lines == [arm], "no note where a fifth is left"
    assert 0.78 < slower <= 0.8
    assert introduced("linux:1", None) == ([arm], pytest.approx(0.78, abs=0.02)), "by default"


def test_an_arm_in_virtual_time_is_never_late() -> None:
    assert introduced("sim", None)[0] == ["arm: simulated"]
