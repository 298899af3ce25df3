"""Hostile clients with a token to look: with a moving arm they delay no STOP and no operator."""

from __future__ import annotations

from pathlib import Path

import pytest

from entries import entry
from hostile.moving_arm import LATENCY, moving_arm

pytestmark = pytest.mark.thorough


def test_floods_of_viewers_delay_no_stop_and_no_operator(tmp_path: Path) -> None:
    with moving_arm(tmp_path) as arm:
        for kind, count in (
            ("ping", 4),
            ("pong", 4),
            ("fragments", 4),
            ("empty", 4),
            ("requests", 4),
            ("cheap", 8),
            ("long", 8),
            ("uploads", 4),
            ("stops", 16),
        ):
            with entry(kind), arm.flooded(kind, count):
                trips = arm.round_trips(2.0)
                assert trips[int(0.95 * len(trips))] < LATENCY, trips[-10:]
                assert arm.stop(arm.post_stop) < LATENCY
                arm.until_moving()
                for _ in range(10):
                    arm.look()
                assert arm.stop(arm.send_stop) < LATENCY
