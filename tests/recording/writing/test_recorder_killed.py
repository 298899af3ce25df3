"""A recorder that is killed, or ended, as a process of its own."""

from __future__ import annotations

import json
import random
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from bioscara.recording.reading.recovery import recover
from bioscara.rosbag.topics import Topic
from programs import LIMIT, environment, wait_for_line
from recording.served_arm import NAME, read, served

LOST = 1.0
"""Longest time of which a killed recorder may lose the events [s]."""


def _recorder(start: Callable[..., subprocess.Popen[str]], out: Path) -> subprocess.Popen[str]:
    words = ("-m", "bioscara", "record", "--arm", NAME, "--out", str(out))
    process = start(*words, cold=True, env=environment())
    wait_for_line(process, "recording ")
    return process


@pytest.mark.realtime
@pytest.mark.parametrize(("seed", "rate"), [(0, 100), (1, 20), (2, 20)])
def test_a_killed_recorder_loses_at_most_a_second_of_events(
    seed: int, rate: int, start: Callable[..., subprocess.Popen[str]], tmp_path: Path
) -> None:
    chance, told = random.Random(seed), dict[str, float]()
    with served(tmp_path, 1.0, rate) as owner:
        process = _recorder(start, tmp_path)
        announce = owner.owner.announce
        end = time.monotonic() + 1.5 + chance.random()
        while time.monotonic() < end:
            text = f"event {len(told)}"
            time.sleep(0.02)
            told[text] = time.monotonic()
            announce("report", text)
        process.kill()
        killed = time.monotonic()
        process.wait(LIMIT)
    (path,) = tmp_path.glob("*.mcap")
    recover(path)
    kept = {json.loads(each.message.data)["text"] for each in read(path, Topic.EVENTS)}
    older = [text for text, when in told.items() if when < killed - LOST]
    assert len(older) > 10
    assert [text for text in older if text not in kept] == []
    samples = read(path, Topic.JOINT_STATES)
    begun = samples[0].log_time
    assert samples[-1].log_time - begun > (killed - min(told.values()) - LOST) * 1e9


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_recorder_that_is_asked_to_end_completes_its_file(
    number: signal.Signals, start: Callable[..., subprocess.Popen[str]], tmp_path: Path
) -> None:
    with served(tmp_path) as owner:
        process = _recorder(start, tmp_path)
        owner.owner.announce("report", "the last event")
        process.send_signal(number)
        assert process.wait(LIMIT) == 0
    (path,) = tmp_path.glob("*.mcap")
    kept = [json.loads(each.message.data)["text"] for each in read(path, Topic.EVENTS)]
    assert "the last event" in kept
