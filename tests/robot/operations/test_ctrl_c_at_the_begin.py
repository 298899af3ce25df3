"""Ctrl-C at any call by which a motion is begun: nothing goes on, and the robot stays usable."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import CodeType, FrameType

import pytest

from bioscara import Robot
from bioscara.robot.operations.operation import Operation
from bioscara.robot.runner import Runner
from served import HALF, eventually, own_robot
from simulated import simulated_bus

CALLS = 60
"""Calls at which the begin of a motion is interrupted, at most: those of its first cycles too."""
NEAR = (*HALF[:3], HALF[3] + 0.01)


@pytest.fixture(params=["watched", "not watched"])
def robot(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Robot]:
    with own_robot(tmp_path, arm=simulated_bus(seed=2, homed=True, at=HALF).arm) as robot:
        robot.enable()
        if request.param == "watched":
            robot.watch(real_time_factor=50.0)
        yield robot


def interrupted(call: Callable[[], object], number: int, codes: set[CodeType]) -> bool:
    """Interrupt a call where Python looks for signals, as it enters a function or returns.

    Args:
        call: The call.
        number: Which of the functions that ``codes`` call, from 0: twice for each.
        codes: Functions at whose calls it may be interrupted.

    Returns:
        Whether there were that many.
    """
    left = number

    def profile(frame: FrameType, event: str, _: object) -> None:
        nonlocal left
        caller = frame if event.startswith("c_") else frame.f_back
        # No signal is looked for between the call of a builtin and its begin.
        if event == "c_call" or caller is None or caller.f_code not in codes:
            return
        left -= 1
        if left < 0:
            sys.setprofile(None)
            raise KeyboardInterrupt

    try:
        sys.setprofile(profile)
        call()
    except KeyboardInterrupt:
        return True
    finally:
        sys.setprofile(None)
    return False


@pytest.mark.parametrize("wait", [True, False])
def test_ctrl_c_at_any_call_of_the_begin_leaves_nothing_running(robot: Robot, wait: bool) -> None:
    begin = Runner.execute if wait else Runner.start
    codes = {each.__code__ for each in (begin, Runner.begin, Operation.begin)}
    for number in range(CALLS):
        goal = HALF if number % 2 else NEAR
        if not interrupted(lambda goal=goal: robot.move_joints(goal, wait=wait), number, codes):
            break
        if not wait:
            eventually(lambda: not robot.is_moving, what=f"the arm rests after {number}")
        assert not robot.is_moving, number
        assert robot.runner.arm.operations == (), number
    assert number > 10
