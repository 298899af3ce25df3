"""Launch files, run by the launch of ROS 2 itself.

Programs of ROS that are written in C++ are replaced by one that records how it was started, and
waits; so is joint_state_publisher, of which there is no wheel. All others are the real ones.
"""

from __future__ import annotations

import json
import os
import re
import signal
import stat
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import pytest

from programs import LIMIT, started, wait_until
from ros.bringup_controllers import BROADCASTER, ended, energise, follow, goal, point
from ros.rig import ROOT, SUCCEEDED, Rig, Ros
from ros_environment import ros_launch

RECORDED = {
    "joint_state_publisher": "joint_state_publisher",
    "joint_state_publisher_gui": "joint_state_publisher_gui",
    "moveit_ros_move_group": "move_group",
    "moveit_setup_assistant": "moveit_setup_assistant",
    "robot_state_publisher": "robot_state_publisher",
    "ros_gz_bridge": "parameter_bridge",
    "ros_gz_sim": "create",
    "rqt_joint_trajectory_controller": "rqt_joint_trajectory_controller",
    "rviz2": "rviz2",
}
"""Programs that are replaced, by their packages."""
_RECORDER = f"""#!{sys.executable} -ES
import json, os, signal, sys
for number in (signal.SIGINT, signal.SIGTERM):
    signal.signal(number, lambda *_: os._exit(0))
files = [sys.argv[place + 1] for place, word in enumerate(sys.argv) if word == "--params-file"]
texts = [open(path).read() for path in files]
line = json.dumps([os.path.basename(sys.argv[0]), sys.argv[1:], texts]) + "\\n"
# In one call, so that lines of several programs are not mixed.
file = os.open(os.environ["RECORD"], os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o644)
os.write(file, line.encode())
while True:
    signal.pause()
"""
_GAZEBO = """
import json, os
from launch import LaunchDescription
from launch.actions import OpaqueFunction
from launch.substitutions import LaunchConfiguration
def record(context):
    value = lambda name: LaunchConfiguration(name).perform(context)
    path = context.environment["GZ_SIM_RESOURCE_PATH"]
    words = [value("gz_args"), value("on_exit_shutdown"), path]
    with open(context.environment["RECORD"], "a") as file:
        file.write(json.dumps(["gz_sim", words, []]) + chr(10))
def generate_launch_description():
    return LaunchDescription([OpaqueFunction(function=record)])
"""
"""Stands for the launch file that starts Gazebo."""
_SRDFDOM = "class SRDF:\n    pass\n"
"""MoveIt's launch files import it for virtual joints, of which our SRDF has none."""
_FAILED = re.compile("Traceback|InvalidHandle|RCLError|escalating|SIGTERM|SIGKILL")
"""Words that the output of a launch that ends in order does not have."""
ENDING = 15.0
"""Time in which everything has to end after Ctrl-C [s]: launch kills after 10 s."""


@dataclass
class Launched:
    """A launch file that runs.

    Attributes:
        process: ``ros2 launch``.
        folder: Folder of its files.
        environment: That of its programs.
    """

    process: subprocess.Popen[str]
    folder: Path
    environment: dict[str, str]

    @property
    def log(self) -> str:
        """The output so far."""
        return (self.folder / "launch.log").read_text()

    def says(self, text: str, limit: float = LIMIT) -> None:
        """Wait until a text is printed."""
        wait_until(lambda: text in self.log, f"{text} is printed", limit)

    def recorded(self, *programs: str) -> dict[str, tuple[list[str], list[str]]]:
        """Wait until these programs were started; return their words and parameter files."""

        def found() -> dict[str, tuple[list[str], list[str]]]:
            record = self.folder / "record"
            # The last line may still be written.
            *lines, _ = record.read_text().split("\n") if record.exists() else [""]
            return {name: (words, texts) for name, words, texts in map(json.loads, lines)}

        wait_until(lambda: found().keys() >= {*programs}, f"{programs} are started")
        return found()

    def spawned(self, count: int) -> None:
        """Wait until so many spawners have ended well."""
        done = re.compile(r"\[spawner-\d+\]: process has finished cleanly")
        wait_until(lambda: len(done.findall(self.log)) == count, f"{count} spawners have ended")

    def ros2(self, *words: str) -> str:
        """Return the output of a command of ``ros2``."""
        done = self._ros2(*words)
        # Started by the command, in the background for hours.
        self._ros2("daemon", "stop")
        return done

    def _ros2(self, *words: str) -> str:
        return subprocess.run(
            ["ros2", *words], env=self.environment, check=True, capture_output=True, text=True,
            timeout=60,
        ).stdout  # fmt: skip


@contextmanager
def launched(
    rig: Rig,
    prefix: Path,
    package: str,
    file: str,
    /,
    *,
    packages: Path | None = None,
    ends: int | None = None,
    **arguments: str,
) -> Iterator[Launched]:
    """Run a launch file, and press Ctrl-C at the end of the block.

    It must end at once, without a traceback, and leave neither processes nor files behind.

    Args:
        rig: Where it runs.
        prefix: The packages.
        package: Package of the file.
        file: Its name, without the ending; a path without the package.
        packages: Where further packages are.
        ends: Exit status of a launch that ends without a signal; None for one that runs.
        **arguments: Of the file.
    """
    folder = Path(tempfile.mkdtemp(prefix="launch", dir=rig.folder))
    (folder / "tmp").mkdir()
    environment = launch_environment(prefix, folder, rig.environment)
    if packages is not None:
        environment["AMENT_PREFIX_PATH"] += f":{packages}"
    words = [f"{name}:={value}" for name, value in arguments.items()]
    command = ["ros2", "launch", *([package] if package else []), f"{file}.launch.py", *words]
    with (
        (folder / "launch.log").open("w") as log,
        started(command, env=environment, stdout=log, stderr=log) as process,
    ):
        made = Launched(process, folder, environment)
        try:
            yield made
            if ends is None:
                assert process.poll() is None
                # As a terminal: to all programs of the group, and launch signals each, too.
                os.killpg(process.pid, signal.SIGINT)
            assert process.wait(ENDING) == (ends or 0)
            assert not re.findall(
                r"Traceback|InvalidHandle|RCLError|escalating|SIGTERM|SIGKILL", made.log
            )
            wait_until(lambda: not _alive(folder), "all programs have ended")
        except BaseException as error:
            error.add_note(f"{made.log}\nstill running: {_alive(folder)}")
            raise
    assert [*(folder / "tmp").iterdir()] == []


def launch_environment(prefix: Path, folder: Path, others: Mapping[str, str]) -> dict[str, str]:
    """Return the environment of programs of launch, whose files are in a folder; or skip the test.

    Args:
        prefix: The packages.
        folder: The folder, in which the programs that are replaced are made.
        others: Further variables.
    """
    recorders = folder / "recorders"
    _make_recorders(recorders)
    variables = {**others, **ros_launch(prefix)}
    variables["AMENT_PREFIX_PATH"] += f":{recorders}"
    return {
        **variables,
        "PYTHONPATH": os.pathsep.join((str(ROOT / "src"), str(recorders))),
        "RECORD": str(folder / "record"),
        "ROS_LOG_DIR": str(folder / "log"),
        "TMPDIR": str(folder / "tmp"),
    }


def _make_recorders(folder: Path) -> None:
    for package, program in RECORDED.items():
        marker = folder / "share/ament_index/resource_index/packages" / package
        path = folder / "lib" / package / program
        for each in (marker, path):
            each.parent.mkdir(parents=True, exist_ok=True)
        marker.touch()
        path.write_text(_RECORDER)
        path.chmod(path.stat().st_mode | stat.S_IXUSR)
    gazebo = folder / "share/ros_gz_sim/launch/gz_sim.launch.py"
    gazebo.parent.mkdir(parents=True)
    gazebo.write_text(_GAZEBO)
    (folder / "srdfdom").mkdir()
    (folder / "srdfdom/__init__.py").touch()
    (folder / "srdfdom/srdf.py").write_text(_SRDFDOM)


def _alive(folder: Path) -> list[str]:
    """Return the commands of the processes that have this folder in their environment."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            if os.fsencode(f"RECORD={folder}/") in (process / "environ").read_bytes():
                found.append((process / "cmdline").read_text().replace("\0", " "))
    return found


def listed(run: Launched, manager: str = "/controller_manager") -> dict[str, str]:
    """Return the states of the controllers, as ``ros2 control`` prints them."""
    text = run.ros2("control", "list_controllers", "-c", manager)
    return {line.split()[0]: line.split()[-1] for line in text.splitlines() if line.strip()}


def states(*inactive: str) -> dict[str, str]:
    return {BROADCASTER: "active", **dict.fromkeys(inactive, "inactive")}


def positions(ros: Ros, joints: list[str]) -> list[float]:
    """Return the positions of joints, as the broadcaster publishes them."""
    topic = f"{ros.namespace}/joint_states"
    ros.do("listen", type="sensor_msgs/JointState", topic=topic)
    state = ros.do("heard", topic=topic)[-1][1]
    at = dict(zip(state["name"], state["position"], strict=True))
    return [float(at[name]) for name in joints]


def moved(ros: Ros, controller: str, joints: list[str], component: str = "bioscara_arm") -> None:
    """Energise the arm, activate a trajectory controller and let it move away from end stops."""
    energise(ros, component)
    assert ros.switch([controller])["ok"]
    end = [0.97 * position for position in positions(ros, joints)]
    sent = goal(point(*end, at=2.0), joints=joints)
    assert ended(ros, follow(ros, controller, sent))["status"] == SUCCEEDED
    ros.do("forget", topic=f"{ros.namespace}/joint_states")
    assert positions(ros, joints) == pytest.approx(end, abs=5e-3)
