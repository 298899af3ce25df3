"""``bioscara ros`` without ROS, and its arguments. With ROS: ``tests/ros``."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable

import pytest

from bioscara.cli.parser import parse
from cli.said import Said
from programs import environment


def test_without_rclpy_one_sentence_names_the_remedy(said: Said) -> None:
    if "rclpy" in sys.modules:
        pytest.skip("this environment has rclpy")
    error = said.refusal("ros --arm left")
    assert "bioscara ros needs rclpy, control_msgs" in error
    assert "source its setup.bash" in error
    assert "make ros2" in error


@pytest.mark.parametrize(
    ("words", "arguments"),
    [
        ([], []),
        (["--ros-args"], ["--ros-args"]),
        (
            ["--ros-args", "-r", "__ns:=/left", "--params-file", "a b.yaml", "-p", "--bus:=1"],
            ["--ros-args", "-r", "__ns:=/left", "--params-file", "a b.yaml", "-p", "--bus:=1"],
        ),
        (["--ros-args", "-p", "a:=1", "--", "--arm", "left"], ["--ros-args", "-p", "a:=1"]),
    ],
)
def test_all_that_follows_ros_args_is_for_ros(words: list[str], arguments: list[str]) -> None:
    options = parse(["ros", *words])
    assert options.ros_arguments == arguments
    assert options.arm == ("left" if "left" in words else None)
    assert not options.bus


def test_serve_runs_the_node_with_arguments_of_ros() -> None:
    words = ["serve", "--with", "web,ros", "--with", "ros --ros-args --params-file f.yaml"]
    assert parse(words).gateways == [
        ("web",),
        ("ros",),
        ("ros", "--ros-args", "--params-file", "f.yaml"),
    ]


def test_the_owner_of_a_node_ends_with_it(start: Callable[..., subprocess.Popen[str]]) -> None:
    """Also where the node is killed: the kernel sends the signal."""
    program = (
        "import time\n"
        "from bioscara.ros.owner_process import OwnerProcess\n"
        "with OwnerProcess('sim', 'mine', 50) as owner:\n"
        "    time.sleep(60)\n"
    )
    node = start("-c", program, env=environment())
    assert node.stdout
    assert "simulation" in node.stdout.readline()
    node.kill()
    node.wait()
    # The owner has the same standard output, and writes its last line to it.
    assert "mine is not served any more; its joints are released" in node.stdout.read()
