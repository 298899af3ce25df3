"""The file of a teach table: YAML of a fixed schema, always complete.

    schema: 1
    tools:
      needle: {x: 0.05, y: 0.0, z: -0.2, yaw: 0.0, mass: 0.1}
    poses:
      plate:
        joints: {j1: 0.3, j2: 0.1, j3: 0.8, j4: 0.0}
        pose: {x: 0.5, y: 0.3, z: 0.03, yaw: 1.1}
        tool: needle
        calibration: 2026-11-03 after new belt
    ...

The last line is part of the schema: a truncated YAML file would often still be valid YAML.
"""

from __future__ import annotations

import fcntl
import io
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

from bioscara.arguments import shown
from bioscara.errors import ConfigurationError, InvalidArgumentError
from bioscara.kinematics import Joints, Pose
from bioscara.kinematics.pose import ANGLE_MAX, PLACE_MAX
from bioscara.model.yaml_section import NODES_MAX, SIZE_MAX, YamlSection, read_text, sections_of
from bioscara.robot.workspace.poses import NamedPose, TeachTable
from bioscara.robot.workspace.tools import FINGERS, MASS_MAX, OFFSET_MAX, Tool
from bioscara.whole_files import replacing

SCHEMA = 1
"""Version of the schema that is read and written."""
_HEADING = """\
# Tools and poses of an arm: 'bioscara poses --help'. Metres, radians, kilograms.
# The file may be edited; comments are lost when it is next saved. It ends with '...'.
"""


def load_table(path: Path, fingers: Tool) -> TeachTable:
    """Return the table in a file.

    Args:
        path: The file.
        fingers: The tool that the parameters describe.

    Raises:
        ConfigurationError: The file cannot be read, is truncated or of another schema, or
            anything in it is unknown, missing or not possible; the message names the line.
    """
    source, text = str(path), read_text(path, str(path))
    if not text.endswith(("\n...\n", "\n...\r\n")):
        raise ConfigurationError(
            f"{source}, line {text.count(chr(10)) + 1}: the file is truncated: it does not end "
            "with a line '...'; if it is whole, add that line"
        )
    top = sections_of(text, source)
    schema = top.whole("schema", 1, 10**6)
    if schema != SCHEMA:
        raise top.error(
            f"schema {schema} is not known: this version reads schema {SCHEMA}; use the version "
            "of bioscara that wrote the file",
            "schema",
        )
    top.refuse_unknown(("schema", "tools", "poses"))
    sections = top.section("tools"), top.section("poses")
    tools = _items(sections[0], _tool, TeachTable(fingers).with_tool)
    # Each pose is checked on its own, against an empty table; YAML allows no name twice.
    poses = _items(sections[1], _pose, TeachTable(fingers, tools).with_pose)
    return TeachTable(fingers, tools, poses)


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


def save_table(path: Path, table: TeachTable) -> None:
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
        with replacing(path) as partial:
            partial.write_bytes(data)
    except OSError as error:
        raise _unkept(path, error) from error


def _unkept(path: Path, error: OSError) -> ConfigurationError:
    return ConfigurationError(
        f"{path}: the poses cannot be saved ({error.strerror or error}); name another file"
    )


_Item = TypeVar("_Item", Tool, NamedPose)


def _items(
    section: YamlSection,
    read: Callable[[str, YamlSection], _Item],
    check: Callable[[_Item], object],
) -> tuple[_Item, ...]:
    items = []
    for name in section.keys():  # noqa: SIM118 -- a section is no mapping
        if not isinstance(name, str):
            raise section.error(
                f"{shown(name)} is not a name; quote it if it is meant as one", name
            )
        try:
            item = read(str(name), section.section(name))
            check(item)
        except ConfigurationError:
            raise
        except InvalidArgumentError as error:
            raise section.error(str(error), name) from error
        items.append(item)
    return tuple(items)


def _numbers(section: YamlSection, sizes: dict[str, tuple[float, str]]) -> list[float]:
    return [section.number(key, -size, size, unit) for key, (size, unit) in sizes.items()]


_ANGLE, _LENGTH = (ANGLE_MAX, "rad"), (PLACE_MAX, "m")
_OFFSET = dict.fromkeys("xyz", (OFFSET_MAX, "m")) | {"yaw": _ANGLE}
_PLACE = dict.fromkeys("xyz", _LENGTH) | {"yaw": _ANGLE}
_JOINTS = {"j1": _ANGLE, "j2": _LENGTH, "j3": _ANGLE, "j4": _ANGLE}


def _tool(name: str, section: YamlSection) -> Tool:
    section.refuse_unknown((*_OFFSET, "mass"))
    offset = Pose(*_numbers(section, _OFFSET))
    return Tool(name, offset, section.number("mass", 0.0, MASS_MAX, "kg"))


def _pose(name: str, section: YamlSection) -> NamedPose:
    section.refuse_unknown(("joints", "pose", "tool", "calibration"))
    keys = set(section.keys())
    joints = pose = None
    if "joints" in keys:
        part = section.section("joints")
        part.refuse_unknown(_JOINTS)
        joints = Joints(*_numbers(part, _JOINTS))
    if "pose" in keys:
        part = section.section("pose")
        part.refuse_unknown(_PLACE)
        pose = Pose(*_numbers(part, _PLACE))
    tool = section.text("tool") if "tool" in keys else FINGERS
    calibration = section.text("calibration") if "calibration" in keys else ""
    return NamedPose(name, joints, pose, str(tool), str(calibration))


def _text(table: TeachTable) -> str:
    # Imported here: only writing a file needs the library.
    from ruamel.yaml import YAML  # noqa: PLC0415

    content = {
        "schema": SCHEMA,
        "tools": {
            tool.name: _floats(tool.pose_tool_in_flange) | {"mass": float(tool.mass)}
            for tool in table.tools
        },
        "poses": {pose.name: _entry(pose) for pose in table.poses},
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
