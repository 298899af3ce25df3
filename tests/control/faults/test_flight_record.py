"""The last seconds of a run, kept and frozen."""

from __future__ import annotations

import time

from bioscara.control.faults.flight_recorder import SECONDS
from control.control_stack import NAMES, World


def test_it_keeps_the_last_seconds_and_no_more() -> None:
    world = World(home=False)
    world.run(SECONDS + 2.0)
    assert len(world.record) == SECONDS * world.rate
    rows = world.record.freeze().rows
    assert rows[-1][0] - rows[0][0] < SECONDS
    assert world.clock.now() - rows[-1][0] < 2 * world.loop.period


def test_what_is_frozen_does_not_change() -> None:
    world = World(home=False)
    world.run(0.5)
    frozen = world.record.freeze()
    rows = frozen.rows
    world.run(0.5)
    assert frozen.rows == rows
    assert len(world.record) > len(rows)


def test_a_frozen_record_says_when_its_newest_cycle_was_kept() -> None:
    world = World(home=False)
    begin = time.time_ns()
    world.run(0.1)
    end = time.time_ns()
    frozen = world.record.freeze()
    assert begin <= frozen.written <= end
    assert frozen.names == NAMES
