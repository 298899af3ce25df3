"""An owner with a simulated arm, the node and clients of ROS 2, each a process."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
import yaml

from bioscara.api.runtime import VARIABLE
from bioscara.model.urdf import URDF
from bioscara.remote import RemoteRobot
from programs import LIMIT, environment, running, started, wait_for_line, wait_until
from ros_environment import ros_environment, ros_python
from served import NAME

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
MANAGER = "/controller_manager"
CONFIGS = (
    ROOT / "ros/bioscara_arm_bringup/config/bioscara_controller_manager.yaml",
    ROOT / "ros/bioscara_arm_bringup/config/bioscara_arm_controllers.yaml",
    ROOT / "ros/bioscara_gripper_bringup/config/bioscara_gripper_controllers.yaml",
)
"""Parameter files that the launch files give to the node."""
PROFILE = """<?xml version="1.0"?>
<dds><profiles xmlns="http://www.eprosima.com">
<transport_descriptors><transport_descriptor>
<transport_id>udp</transport_id><type>UDPv4</type>
</transport_descriptor></transport_descriptors>
<participant profile_name="quick" is_default_profile="true"><rtps>
<userTransports><transport_id>udp</transport_id></userTransports>
<useBuiltinTransports>false</useBuiltinTransports>
<builtin><discovery_config>
<leaseDuration><sec>3</sec></leaseDuration>
<leaseAnnouncement><sec>0</sec><nanosec>200000000</nanosec></leaseAnnouncement>
<initialAnnouncements><count>10</count><period><sec>0</sec><nanosec>50000000</nanosec></period></initialAnnouncements>
</discovery_config></builtin></rtps></participant></profiles></dds>
"""
"""Settings of Fast DDS: a missed announcement costs 0.2 s instead of 3 s, and a program that was
killed is forgotten after 3 s."""
SUCCEEDED, CANCELED, ABORTED = 4, 5, 6
"""Status of a goal of an action."""


class RosError(Exception):
    """A client has failed."""


class Ros:
    """The clients; the methods are those of ``ros_client.Clients``.

    Args:
        process: Their process.

    Attributes:
        namespace: That of the node; empty for none.
    """

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._process = process
        self.namespace = ""

    def do(self, op: str, **arguments: Any) -> Any:
        """Let the clients do something, and return the answer."""
        assert self._process.stdin
        assert self._process.stdout
        print(json.dumps({"op": op, **arguments}), file=self._process.stdin, flush=True)
        line = self._process.stdout.readline()
        assert line, "the process of the clients has ended"
        answer = json.loads(line)
        if "error" in answer:
            raise RosError(answer["error"])
        return answer["answer"]

    def call(self, kind: str, name: str, /, **request: Any) -> Any:
        """Call a service."""
        call = {"type": kind, "name": name, "request": request}
        return self.do("calls", calls=[call])["answers"][0]

    def manager(self, name: str, /, **request: Any) -> Any:
        """Call a service of the controller manager."""
        return self.call(manager_type(name), f"{self.namespace}{MANAGER}/{name}", **request)

    def switch(
        self, activate: Sequence[str] = (), deactivate: Sequence[str] = (), strictness: int = 2
    ) -> Any:
        """Switch controllers."""
        return self.manager(
            "switch_controller",
            activate_controllers=list(activate),
            deactivate_controllers=list(deactivate),
            strictness=strictness,
            activate_asap=True,
            timeout={"sec": 5},
        )

    def hardware(self, name: str, state: str) -> Any:
        """Bring a component to a state."""
        return self.manager(
            "set_hardware_component_state", name=name, target_state={"label": state}
        )

    def states(self) -> dict[str, str]:
        """Return the states of all controllers."""
        listed = self.manager("list_controllers")["controller"]
        return {each["name"]: each["state"] for each in listed}

    def components(self) -> dict[str, str]:
        """Return the states of all components."""
        listed = self.manager("list_hardware_components")["component"]
        return {each["name"]: each["state"]["label"] for each in listed}

    def found(self) -> None:
        """Wait until the manager answers, after another one of its name was killed."""
        call = {"type": manager_type("list_controllers"), "name": f"{MANAGER}/list_controllers"}
        for _ in range(10):
            try:
                self.do("calls", calls=[{**call, "request": {}}], timeout=2.0)
            except RosError:
                continue
            return
        raise AssertionError("the manager does not answer")

    def spawn(self, name: str, *, active: bool = True) -> None:
        """Load, configure and activate a controller, as a spawner does."""
        if name not in self.states():
            assert self.manager("load_controller", name=name)["ok"]
        assert self.manager("configure_controller", name=name)["ok"]
        if active:
            answer = self.switch([name])
            assert answer["ok"], answer

    def set_parameters(self, node: str, **values: Any) -> list[dict[str, Any]]:
        """Set parameters of a node; names have ``__`` for dots."""
        listed = [
            {"name": name.replace("__", "."), "value": parameter_value(value)}
            for name, value in values.items()
        ]
        results: list[dict[str, Any]] = self.call(
            "rcl_interfaces/srv/SetParameters", f"{node}/set_parameters", parameters=listed
        )["results"]
        return results


def manager_type(name: str) -> str:
    """Return the type of a service of the controller manager."""
    return "controller_manager_msgs/srv/" + "".join(part.title() for part in name.split("_"))


def parameter_value(value: Any) -> dict[str, Any]:
    """Return a value as a message of parameters has it."""
    if isinstance(value, bool):
        return {"type": 1, "bool_value": value}
    if isinstance(value, int):
        return {"type": 2, "integer_value": value}
    if isinstance(value, float):
        return {"type": 3, "double_value": value}
    if isinstance(value, str):
        return {"type": 4, "string_value": value}
    return {"type": 9, "string_array_value": list(value)}


class Rig:
    """The processes, and where they find each other.

    Args:
        folder: Folder for their files, with a short path.
        domain: Domain of ROS.

    Attributes:
        environment: That of programs of ROS.
        folder: As given.
        owner_pid: Process of the owner that was started last.
        python: Python with the wheels of ROS.
    """

    def __init__(self, folder: Path, domain: int) -> None:
        self.folder = folder
        self.owner_pid = 0
        self.python = ros_python()
        (folder / "dds.xml").write_text(PROFILE)
        self.environment = ros_environment(
            ROS_DOMAIN_ID=str(domain),
            FASTDDS_DEFAULT_PROFILES_FILE=str(folder / "dds.xml"),
            ROS_HOME=str(folder / "ros"),
            PYTHONUNBUFFERED="1",
            PYTHONPATH=str(ROOT / "src"),
            **{VARIABLE: str(folder)},
        )

    @contextmanager
    def owner(self, *at: float | str, speed: float = 1.0) -> Iterator[subprocess.Popen[str]]:
        """Serve an arm; ``at`` is where it stands, homed, or WORLD for one among bodies."""
        words = [str(HERE / "arm_to_serve.py"), str(speed), *map(str, at)]
        with running(*words, env=environment(**{VARIABLE: str(self.folder)})) as process:
            wait_for_line(process, "served")
            self.owner_pid = process.pid
            yield process

    @contextmanager
    def node(
        self,
        *words: str,
        description: str | None = None,
        parameters: Mapping[str, Any] | None = None,
        configs: Sequence[Path] = CONFIGS,
        stderr: int | None = None,
    ) -> Iterator[subprocess.Popen[str]]:
        """Run ``bioscara ros``; its log is ``node.log``.

        Args:
            *words: Its arguments; by default the served arm.
            description: The URDF; empty for none, None for that of the arm.
            parameters: Further parameters of the manager.
            configs: Parameter files.
            stderr: Descriptor for its log; None for the file.
        """
        text = URDF.read_text() if description is None else description
        given = {**({"robot_description": text} if text else {}), **(parameters or {})}
        file = self.folder / f"manager{len(list(self.folder.glob('manager*')))}.yaml"
        content = {"controller_manager": {"ros__parameters": given}}
        file.write_text(yaml.safe_dump(content, width=10**9))
        files = [word for path in (file, *configs) for word in ("--params-file", str(path))]
        if not given:
            files = files[2:]
        ros = ["--ros-args", *files] if files else []
        with (self.folder / "node.log").open("a") as log:
            command = [self.python, "-m", "bioscara", "ros", *(words or ("--arm", NAME)), *ros]
            files = {"stdout": log, "stderr": log if stderr is None else stderr}
            with started(command, env=self.environment, **files) as process:
                try:
                    yield process
                finally:
                    if process.poll() is None:
                        process.send_signal(signal.SIGINT)
                        with suppress(subprocess.TimeoutExpired):
                            process.wait(LIMIT)

    @property
    def log(self) -> str:
        """Output of the nodes."""
        return (self.folder / "node.log").read_text()

    def logged(self, text: str, before: str = "") -> None:
        """Wait for a text in the output after that of before: a thread of the node writes it."""
        wait_until(lambda: text in self.log.removeprefix(before), f"{text!r} in the log")

    @contextmanager
    def observed(self) -> Iterator[RemoteRobot]:
        """Connect another client of the owner."""
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv(VARIABLE, str(self.folder))
            with RemoteRobot(NAME) as robot:
                yield robot

    @contextmanager
    def clients(self) -> Iterator[Ros]:
        """Run the clients."""
        with started(
            [self.python, str(HERE / "ros_client.py")],
            env=self.environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        ) as process:
            yield Ros(process)
            process.communicate(timeout=LIMIT)


@contextmanager
def rig(domain: int = 0) -> Iterator[Rig]:
    """Make a rig in a folder of its own.

    Args:
        domain: Number among the rigs of this process; those with different ones do not meet.
    """
    with tempfile.TemporaryDirectory(prefix="b", dir="/tmp") as folder:
        yield Rig(Path(folder), (os.getpid() + 31 * domain) % 100)
