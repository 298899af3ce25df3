"""The executor of the node misses no message of a stream, and survives a callback that fails.

Entities may be destroyed while it waits for them.
"""

from __future__ import annotations

import json
import subprocess
from contextlib import AbstractContextManager
from pathlib import Path

import pytest

from programs import started
from ros_environment import ros_environment, ros_python

PROGRAM = Path(__file__).with_name("executor_program.py")
COUNT = 300


pytestmark = pytest.mark.ros


def program(*words: object) -> AbstractContextManager[subprocess.Popen[str]]:
    command = [ros_python(), PROGRAM, *map(str, words)]
    return started(command, env=ros_environment(), stdout=subprocess.PIPE)


def test_a_stream_at_100_hz_is_received_while_its_callbacks_run() -> None:
    with program("receive", COUNT) as receiver, program("publish", COUNT) as publisher:
        output, _ = receiver.communicate(timeout=60.0)
        publisher.wait(timeout=60.0)
    numbers, failures = json.loads(output)
    assert numbers == sorted(numbers)
    # A computer with other work loses some: the queue of the subscription is short.
    assert len(numbers) > 0.6 * COUNT, f"{len(numbers)} of {COUNT}, up to {numbers[-1]}"
    assert failures == ["ValueError('fails')"] * (3 in numbers)


def test_destroyed_entities_are_no_failure_while_it_waits_or_ends() -> None:
    with program("destroy", 40) as destroyer:
        output, _ = destroyer.communicate(timeout=60.0)
    assert json.loads(output) == []
