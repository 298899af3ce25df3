"""The node of ROS 2, and programs that measure it, each a process."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import yaml

ROOT = Path(__file__).parents[1]
if str(ROOT / "tests") not in sys.path:
    sys.path.insert(0, str(ROOT / "tests"))

from ros.rig import Rig, rig  # noqa: E402  of the tests

__all__ = ["BROADCASTER", "FOLLOWER", "NAME", "STREAM", "Program", "Rig", "node", "program", "rig"]

NAME = "bench"
"""Name of the owner."""
BROADCASTER, FOLLOWER = "joint_state_broadcaster", "position_joint_trajectory_controller"
STREAM = "stream_controller"
"""A controller that forwards positions."""
_STREAM = {
    STREAM: {"ros__parameters": {"joints": ["j1", "j2", "j3", "j4"], "interface_name": "position"}}
}
_CONFIGS = tuple(
    ROOT / "ros/bioscara_arm_bringup/config" / name
    for name in ("bioscara_controller_manager.yaml", "bioscara_arm_controllers.yaml")
)


class Program:
    """A program of :mod:`benchmarks.ros_program`.

    Args:
        process: Its process.

    Attributes:
        number: Number of the process.
    """

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._process = process
        self.number = process.pid

    def begin(self, word: str, *arguments: Any) -> None:
        """Let it do something."""
        print(json.dumps([word, *arguments]), file=self._process.stdin, flush=True)

    def end(self) -> Any:
        """Return the answer to that."""
        assert self._process.stdout
        line = self._process.stdout.readline()
        if not line:
            raise RuntimeError("the program of ROS has ended")
        return json.loads(line)

    def do(self, word: str, *arguments: Any) -> Any:
        """Let it do something, and return the answer."""
        self.begin(word, *arguments)
        return self.end()


@contextmanager
def program(made: Rig, what: str) -> Iterator[Program]:
    """Run a program.

    Args:
        made: The environment.
        what: ``"client"`` or ``"publisher"``.
    """
    with subprocess.Popen(
        [made.python, Path(__file__).parent / "ros_program.py", what],
        env=made.environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            yield Program(process)
            process.communicate(timeout=20.0)
        finally:
            process.kill()


@contextmanager
def node(made: Rig, *active: str) -> Iterator[subprocess.Popen[str]]:
    """Run the node of a served arm with active controllers."""
    file, manager = made.folder / "stream.yaml", made.folder / "rate.yaml"
    file.write_text(yaml.safe_dump(_STREAM))
    kind = "forward_command_controller/ForwardCommandController"
    parameters = {"update_rate": 100, STREAM: {"type": kind, "params_file": [str(file)]}}
    # Last, for the rate.
    manager.write_text(yaml.safe_dump({"controller_manager": {"ros__parameters": parameters}}))
    with made.node("--arm", NAME, configs=(*_CONFIGS, manager)) as process:
        try:
            with made.clients() as clients:
                clients.found()
                clients.hardware("bioscara_arm", "active")
                for name in active:
                    clients.spawn(name)
        except AssertionError as error:
            raise RuntimeError(f"the controllers are not active: {made.log}") from error
        yield process
