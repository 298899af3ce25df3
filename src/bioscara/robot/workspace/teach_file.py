"""The file of a teach table: YAML of a fixed schema, always complete.

    schema: 2
    tools:
      needle: {x: 0.05, y: 0.0, z: -0.2, yaw: 0.0, mass: 0.1}
    poses:
      plate:
        joints: {j1: 0.3, j2: 0.1, j3: 0.8, j4: 0.0}
        pose: {x: 0.5, y: 0.3, z: 0.03, yaw: 1.1}
        tool: needle
        calibration: 2026-11-03 after new belt
    frames:
      bench: {x: 0.3, y: -0.1, z: 0.02, yaw: 0.0}
    ...

Frames are of schema 2; a table without frames is written by schema 1, which earlier versions read.
The last line is part of the schema: a truncated YAML file would often still be valid YAML.
"""

from __future__ import annotations

import fcntl
import io
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, field
from pathlib import Path
from typing import Annotated

from bioscara.errors import ConfigurationError, InvalidArgumentError
from bioscara.files.whole_files import replacing
from bioscara.kinematics import Joints, Pose
from bioscara.kinematics.pose import ANGLE_MAX, PLACE_MAX
from bioscara.model import load_parameters
from bioscara.model.validation import Checked, Name, Problem, Within
from bioscara.model.yaml_file import NODES_MAX, SIZE_MAX, YamlFile, read_text
from bioscara.robot.workspace.frames import Frame
from bioscara.robot.workspace.poses import NamedPose, TeachTable
from bioscara.robot.workspace.tools import (
    FINGERS,
    MASS_MAX,
    OFFSET_MAX,
    Tool,
    fingers as gripper_of,
)

SCHEMA, WITH_FRAMES = 1, 2
"""Versions of the schema that are read and written: without frames, and with them."""
_HEADING = """\
# Tools, poses and frames of an arm: 'bioscara poses --help'. Metres, radians, kilograms.
# The file may be edited; comments are lost when it is next saved. It ends with '...'.
"""


def load_table(path: Path | str, fingers: Tool | None = None) -> TeachTable:
    """Return the table in a file.

    Args:
        path: The file.
        fingers: The tool that the parameters describe; None for that of the committed parameters.
            A robot whose ``table`` is set puts its own there in any case.

    Raises:
        ConfigurationError: The file cannot be read, is truncated or of another schema, or
            anything in it is unknown, missing or not possible; the message names the line.
    """
    source, text = str(path), read_text(Path(path), str(path))
    if not text.endswith(("\n...\n", "\n...\r\n")):
        raise ConfigurationError(
            f"{source}, line {text.count(chr(10)) + 1}: the file is truncated: it does not end "
            "with a line '...'; if it is whole, add that line"
        )
    file = YamlFile(text, source)
    file.check_version("schema", SCHEMA, WITH_FRAMES)
    given = _Table.checked(file.values, file.place)
    if fingers is None:
        fingers = gripper_of(load_parameters())
    tools, poses, frames = [], [], []
    check_tool = TeachTable(fingers).with_tool
    for name, tool in given.tools.items():
        with _located(file, "tools", name):
            check_tool(made := tool.made(name))
        tools.append(made)
    # Each pose is checked on its own, against an empty table; YAML allows no name twice.
    check_pose = TeachTable(fingers, tuple(tools)).with_pose
    for name, pose in given.poses.items():
        with _located(file, "poses", name):
            check_pose(taught := pose.made(name))
        poses.append(taught)
    for name, place in given.frames.items():
        with _located(file, "frames", name):
            frames.append(Frame(name, Pose(**asdict(place))))
    return TeachTable(fingers, tuple(tools), tuple(poses), tuple(frames))


@contextmanager
def _located(file: YamlFile, *location: str) -> Iterator[None]:
    try:
        yield
    except InvalidArgumentError as error:
        raise ConfigurationError(f"{file.place(location)}{error}") from error


@contextmanager
def changing(path: Path) -> Iterator[None]:
    """Lock the file of a table while it is read, changed and saved.

    Other callers wait for the lock, in this process or another. Reading alone needs no lock.

    Args:
        path: The file; it need not exist.

    Raises:
        ConfigurationError: Its folder cannot be opened.
    """
    try:
        # Not the file, which saving replaces, nor a separate lock file, which would be left over.
        folder = os.open(Path(os.path.realpath(path)).parent, os.O_RDONLY)
    except OSError as error:
        raise _unkept(path, error) from error
    try:
        fcntl.flock(folder, fcntl.LOCK_EX)
        yield
    finally:
        os.close(folder)


def save_table(path: Path | str, table: TeachTable) -> None:
    """Write a table to a file atomically: it then holds the whole table or its former content.

    Changes that others saved since the table was loaded are lost, unless both loading and saving
    are done within :func:`changing`.

    Args:
        path: The file; if it is a link, its target is written.
        table: The table; the fingers are not written, as they are part of the parameters.

    Raises:
        ConfigurationError: The file cannot be written, or would be too large to be read again.
    """
    data = _text(table).encode()
    # Each line has two YAML nodes: a name, and a value or the nested mapping.
    lines = data.count(b"\n")
    if len(data) > SIZE_MAX or 2 * lines > NODES_MAX:
        raise ConfigurationError(
            f"{path}: the poses take {len(data) / 2**20:.2f} MiB and {lines} lines, "
            f"a file holds {SIZE_MAX // 2**20} MiB and {NODES_MAX // 2} lines; remove some, or "
            "keep them in two files"
        )
    try:
        with replacing(Path(path)) as partial:
            partial.write_bytes(data)
    except OSError as error:
        raise _unkept(path, error) from error


def _unkept(path: Path | str, error: OSError) -> ConfigurationError:
    return ConfigurationError(
        f"{path}: the poses cannot be saved ({error.strerror or error}); name another file"
    )


_Angle = Annotated[float, Within(-ANGLE_MAX, ANGLE_MAX, "rad")]
_Length = Annotated[float, Within(-PLACE_MAX, PLACE_MAX, "m")]
_Offset = Annotated[float, Within(-OFFSET_MAX, OFFSET_MAX, "m")]


class _Tool(Checked):
    x: _Offset
    y: _Offset
    z: _Offset
    yaw: _Angle
    mass: Annotated[float, Within(0.0, MASS_MAX, "kg")]

    def made(self, name: str) -> Tool:
        return Tool(name, Pose(self.x, self.y, self.z, self.yaw), self.mass)


class _Joints(Checked):
    j1: _Angle
    j2: _Length
    j3: _Angle
    j4: _Angle


class _Place(Checked):
    x: _Length
    y: _Length
    z: _Length
    yaw: _Angle


class _Pose(Checked):
    joints: _Joints | None = None
    pose: _Place | None = None
    tool: Name = FINGERS
    calibration: Name = ""

    def made(self, name: str) -> NamedPose:
        joints = Joints(**asdict(self.joints)) if self.joints else None
        pose = Pose(**asdict(self.pose)) if self.pose else None
        return NamedPose(name, joints, pose, self.tool, self.calibration)


class _Table(Checked):
    schema: Annotated[int, Within(1, 10**6)]
    tools: dict[str, _Tool]
    poses: dict[str, _Pose]
    frames: dict[str, _Place] = field(default_factory=dict)

    def problems(self) -> Iterator[Problem]:
        """Yield frames in a schema without them."""
        if self.frames and self.schema == SCHEMA:
            yield Problem(f"frames are of schema {WITH_FRAMES}; change the schema", ("frames",))


def _text(table: TeachTable) -> str:
    # Imported here: only writing a file needs the library.
    from ruamel.yaml import YAML  # noqa: PLC0415

    content: dict[str, object] = {
        "schema": WITH_FRAMES if table.frames else SCHEMA,
        "tools": {
            tool.name: _floats(tool.pose_tool_in_flange) | {"mass": float(tool.mass)}
            for tool in table.tools
        },
        "poses": {pose.name: _entry(pose) for pose in table.poses},
    }
    if table.frames:
        content["frames"] = {
            frame.name: _floats(frame.pose_frame_in_base) for frame in table.frames
        }
    yaml = YAML(typ="safe", pure=True)
    yaml.explicit_end, yaml.width, yaml.allow_unicode = True, 10_000, True
    yaml.representer.sort_base_mapping_type_on_output = False
    stream = io.StringIO()
    yaml.dump(content, stream)
    return _HEADING + stream.getvalue()


def _entry(pose: NamedPose) -> dict[str, object]:
    entry: dict[str, object] = {}
    if pose.joints is not None:
        entry["joints"] = _floats(pose.joints)
    if pose.pose_tool_in_base is not None:
        entry["pose"] = _floats(pose.pose_tool_in_base)
    entry["tool"] = pose.tool
    if pose.calibration:
        entry["calibration"] = pose.calibration
    return entry


def _floats(values: Pose | Joints) -> dict[str, float]:
    return {field: float(value) for field, value in values._asdict().items()}
