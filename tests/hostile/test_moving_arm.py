"""The arm of these tests itself: without an attack STOP arrives at once through each door."""

from __future__ import annotations

from pathlib import Path

from bioscara.api import messages as m
from hostile.moving_arm import LATENCY, moving_arm
from served import RawClient


def test_a_stop_arrives_through_each_door(tmp_path: Path) -> None:
    with moving_arm(tmp_path) as arm, RawClient("stopper", path=arm.socket) as client:
        found = [arm.stop(lambda: client.request(m.StopAll())), arm.stop(arm.post_stop)]
    assert max(found) < LATENCY
