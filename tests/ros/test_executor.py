"""The executor of the node misses no message of a stream, and survives a callback that fails."""

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


@pytest.mark.ros
def test_a_stream_at_100_hz_is_received_while_its_callbacks_run() -> None:
    python, environment = ros_python(), ros_environment()

    def start(what: str) -> AbstractContextManager[subprocess.Popen[str]]:
        command = [python, PROGRAM, what, str(COUNT)]
        return started(command, env=environment, stdout=subprocess.PIPE)

    with start("receive") as receiver, start("publish") as publisher:
        output, _ = receiver.communicate(timeout=60.0)
        publisher.wait(timeout=60.0)
    numbers, failures = json.loads(output)
    assert numbers == sorted(numbers)
    # A computer with other work loses some: the queue of the subscription is short.
    assert len(numbers) > 0.6 * COUNT, f"{len(numbers)} of {COUNT}, up to {numbers[-1]}"
    assert failures == ["ValueError('fails')"] * (3 in numbers)
