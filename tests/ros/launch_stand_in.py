"""A stand-in for ``launch`` and ``launch_ros``, which are not on PyPI.

It has the few classes that our launch files use, with the meaning of the real ones, and records
the programs that would be started. It is not ROS: it shows that the files run and which programs
they request, not that ROS accepts them.
"""

from __future__ import annotations

import runpy
import shlex
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any
from xml.etree import ElementTree as ET

import pytest

from ros.share import PackageNotFoundError, expand

TRUE, FALSE = ("true", "1"), ("false", "0")


class LaunchContext:
    def __init__(self, prefix: Path) -> None:
        self.prefix = prefix
        self.launch_configurations: dict[str, str] = {}


def perform(value: Any, context: LaunchContext) -> str:
    """Return the text of a value: text, a substitution, or a list of both."""
    if isinstance(value, str):
        return value
    if isinstance(value, (list, tuple)):
        return "".join(perform(each, context) for each in value)
    text = value.perform(context)
    assert isinstance(text, str)
    return text


@dataclass
class LaunchConfiguration:
    name: str

    def perform(self, context: LaunchContext) -> str:
        return context.launch_configurations[self.name]


@dataclass
class FindPackageShare:
    package: Any

    def perform(self, context: LaunchContext) -> str:
        path = context.prefix / "share" / perform(self.package, context)
        if not path.is_dir():
            raise PackageNotFoundError(path.name)
        return str(path)


@dataclass
class PathJoinSubstitution:
    parts: Iterable[Any]

    def perform(self, context: LaunchContext) -> str:
        return str(Path(*(perform(part, context) for part in self.parts)))


@dataclass
class FindExecutable:
    name: str

    def perform(self, context: LaunchContext) -> str:
        return self.name


@dataclass
class Command:
    """Runs xacro alone, in this process."""

    command: Any

    def perform(self, context: LaunchContext) -> str:
        program, path, *words = shlex.split(perform(self.command, context))
        assert program == "xacro"
        given = dict(word.split(":=") for word in words)
        root = expand(Path(path), **{name: value for name, value in given.items() if value})
        return ET.tostring(root, encoding="unicode")


@dataclass
class ParameterValue:
    value: Any
    value_type: type


@dataclass
class IfCondition:
    expression: Any

    def evaluate(self, context: LaunchContext) -> bool:
        text = perform(self.expression, context).lower()
        assert text in TRUE + FALSE, f"{text} is no condition"
        return text in TRUE


class UnlessCondition(IfCondition):
    def evaluate(self, context: LaunchContext) -> bool:
        return not super().evaluate(context)


@dataclass
class DeclareLaunchArgument:
    name: str
    default_value: Any = None
    description: str = ""
    choices: list[str] | None = None


@dataclass
class OpaqueFunction:
    function: Callable[..., Any]


@dataclass
class Shutdown:
    reason: str


@dataclass
class OnProcessExit:
    target_action: Any
    on_exit: list[Any]


@dataclass
class RegisterEventHandler:
    handler: OnProcessExit


@dataclass
class PythonLaunchDescriptionSource:
    path: Any


@dataclass
class IncludeLaunchDescription:
    source: PythonLaunchDescriptionSource
    launch_arguments: Iterable[tuple[str, Any]] = ()


@dataclass
class LaunchDescription:
    entities: list[Any] = field(default_factory=list)


class Node:
    def __init__(
        self, *, package: str, executable: str, name: str | None = None,
        arguments: Iterable[Any] = (), parameters: Iterable[Any] = (), output: str = "log",
        condition: IfCondition | None = None, on_exit: Any = None,
    ) -> None:  # fmt: skip
        self.package, self.executable, self.name = package, executable, name
        self.arguments, self.parameters = arguments, parameters
        self.output, self.condition, self.on_exit = output, condition, on_exit


class MoveItConfigs:
    """Records the calls by which a configuration is built."""

    def __init__(self, robot: str = "", package_name: str = "") -> None:
        self.calls: dict[str, Any] = {"robot": robot, "package": package_name}

    def __getattr__(self, name: str) -> Callable[..., Any]:
        def call(**options: Any) -> MoveItConfigs:
            self.calls[name] = options
            return self

        return call

    def to_dict(self) -> MoveItConfigs:
        return self


@dataclass
class Generated:
    """A launch description that MoveIt writes."""

    kind: str
    config: MoveItConfigs


@dataclass
class Started:
    """A program that a launch file starts.

    Attributes:
        package, executable: Its names.
        arguments: Its words before ``--ros-args``.
        parameters: Texts of parameter files, and values as maps.
        name: Name given to all of its nodes; None for their own names.
        after: Program whose end it waits for, as ``executable first-argument``; empty for none.
        ends: Whether its end ends the launch.
        output: Where its output goes.
    """

    package: str
    executable: str
    arguments: list[str]
    parameters: list[Any]
    name: str | None
    after: str
    ends: bool
    output: str


class Launch:
    """The effects of a launch file.

    Attributes:
        arguments: Default values of the arguments of the file itself; None where it has none.
        started: Programs, in their order.
        generated: What MoveIt would add.
    """

    def __init__(self, prefix: Path, path: Path, given: Mapping[str, str]) -> None:
        self.context = LaunchContext(prefix)
        self.context.launch_configurations |= given
        self.arguments: dict[str, str | None] = {}
        self.started: list[Started] = []
        self.generated: list[Generated] = []
        self._depth = 0
        self._run(path)

    def _run(self, path: Path) -> None:
        self._depth += 1
        description = runpy.run_path(str(path))["generate_launch_description"]()
        if isinstance(description, Generated):
            self.generated.append(description)
        else:
            self._visit(description.entities)
        self._depth -= 1

    def _visit(self, entities: Iterable[Any], after: str = "") -> None:
        for entity in entities:
            match entity:
                case DeclareLaunchArgument():
                    self._declare(entity)
                case IncludeLaunchDescription():
                    given = {
                        name: perform(value, self.context)
                        for name, value in entity.launch_arguments
                    }
                    self.context.launch_configurations |= given
                    self._run(Path(perform(entity.source.path, self.context)))
                case OpaqueFunction():
                    self._visit(entity.function(self.context))
                case RegisterEventHandler():
                    node = entity.handler.target_action
                    words = " ".join([node.executable, *node.arguments][:2])
                    self._visit(entity.handler.on_exit, words)
                case Node():
                    self._start(entity, after)
                case _:
                    raise TypeError(entity)

    def _declare(self, argument: DeclareLaunchArgument) -> None:
        default = argument.default_value
        text = None if default is None else perform(default, self.context)
        if self._depth == 1:
            self.arguments[argument.name] = text
        if argument.name not in self.context.launch_configurations:
            assert text is not None, f"{argument.name} has no value"
            self.context.launch_configurations[argument.name] = text
        value = self.context.launch_configurations[argument.name]
        if argument.choices is not None and value not in argument.choices:
            raise ValueError(f"{argument.name} is {value}, not one of {argument.choices}")

    def _start(self, node: Node, after: str) -> None:
        if node.condition is not None and not node.condition.evaluate(self.context):
            return
        self.started.append(
            Started(
                node.package,
                node.executable,
                [perform(word, self.context) for word in node.arguments],
                [self._parameters(each) for each in node.parameters],
                node.name,
                after,
                isinstance(node.on_exit, Shutdown),
                node.output,
            )
        )

    def _parameters(self, given: Any) -> Any:
        if isinstance(given, MoveItConfigs):
            return given
        if not isinstance(given, dict):
            return perform(given, self.context)
        values = {}
        for name, value in given.items():
            if isinstance(value, ParameterValue):
                # Otherwise launch_ros parses the text as YAML.
                assert value.value_type is str
                values[name] = perform(value.value, self.context)
            else:
                values[name] = value
        return values


MODULES: dict[str, tuple[Any, ...]] = {
    "launch": (LaunchContext, LaunchDescription),
    "launch.actions": (
        DeclareLaunchArgument, IncludeLaunchDescription, OpaqueFunction, RegisterEventHandler,
        Shutdown,
    ),
    "launch.conditions": (IfCondition, UnlessCondition),
    "launch.event_handlers": (OnProcessExit,),
    "launch.launch_description_sources": (PythonLaunchDescriptionSource,),
    "launch.substitutions": (Command, FindExecutable, LaunchConfiguration, PathJoinSubstitution),
    "launch_ros": (),
    "launch_ros.actions": (Node,),
    "launch_ros.parameter_descriptions": (ParameterValue,),
    "launch_ros.substitutions": (FindPackageShare,),
    "moveit_configs_utils": (),
    "moveit_configs_utils.launches": (),
}  # fmt: skip


def install(monkeypatch: pytest.MonkeyPatch, prefix: Path) -> None:
    """Let launch files and xacro find the stand-in, and the packages in a prefix."""

    def share(package: str) -> str:
        path = prefix / "share" / package
        if not path.is_dir():
            raise PackageNotFoundError(package)
        return str(path)

    def generator(kind: str) -> Callable[[MoveItConfigs], Generated]:
        return lambda config: Generated(kind, config)

    for name, classes in MODULES.items():
        module = ModuleType(name)
        vars(module).update({each.__name__: each for each in classes})
        monkeypatch.setitem(sys.modules, name, module)
    vars(sys.modules["moveit_configs_utils"])["MoveItConfigsBuilder"] = MoveItConfigs
    for kind in ("moveit_rviz", "setup_assistant"):
        vars(sys.modules["moveit_configs_utils.launches"])[f"generate_{kind}_launch"] = generator(
            kind
        )
    for name in ("ament_index_python", "ament_index_python.packages"):
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
    vars(sys.modules["ament_index_python.packages"]).update(
        get_package_share_directory=share, PackageNotFoundError=PackageNotFoundError
    )
