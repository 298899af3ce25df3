"""Named poses, tools and frames: taught ones and built-in ones."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from bioscara.arguments import items, shown, text
from bioscara.errors import InvalidArgumentError
from bioscara.kinematics import Joints, Pose
from bioscara.kinematics.pose import ANGLE_MAX, PLACE_MAX
from bioscara.notebook import table
from bioscara.robot.workspace.frames import Frame
from bioscara.robot.workspace.tools import FINGERS, Tool, check_name, check_number, unknown


@dataclass(frozen=True, slots=True)
class NamedPose:
    """A named position of the arm or pose of its tool.

    Joints are the goal irrespective of the tool. A pose alone is reached by the closest joint
    solution. If both are given, the joints are the goal and the pose records where the tool was.

    Attributes:
        name: Letters, digits, ``_`` and ``-``, with single spaces between; begins with a letter.
        joints: Positions of the joints [rad, m, rad, rad], or None.
        pose_tool_in_base: Pose of the tool in the base, or None.
        tool: Name of the tool that it was taught with.
        calibration: Identifier of the calibration that it was taught with; empty if not given. A
            record only: it is not compared with anything.

    Raises:
        InvalidArgumentError: Both joints and pose are missing, or a value is not possible.
    """

    name: str
    joints: Joints | None = None
    pose_tool_in_base: Pose | None = None
    tool: str = FINGERS
    calibration: str = ""

    def __post_init__(self) -> None:
        check_name("pose", self.name, words=True)
        check_name("tool", self.tool)
        if self.joints is None and self.pose_tool_in_base is None:
            raise InvalidArgumentError(f"pose {self.name} has neither joints nor a pose")
        calibration = text(f"pose {self.name}, calibration", self.calibration)
        if len(calibration) > 100 or not calibration.isprintable():
            raise InvalidArgumentError(
                f"pose {self.name}, calibration {shown(calibration)}: an id is one printable line "
                "of at most 100 characters"
            )
        for name, kind in (("joints", Joints), ("pose_tool_in_base", Pose)):
            part = getattr(self, name)
            if part is None:
                continue
            if not isinstance(part, kind):
                raise InvalidArgumentError(
                    f"pose {self.name}: {shown(part)} is not a {kind.__name__}"
                )
            values = []
            for field, value in zip(part._fields, part, strict=True):
                length = field in {"j2", "x", "y", "z"}
                size, unit = (PLACE_MAX, "m") if length else (ANGLE_MAX, "rad")
                values.append(check_number(f"pose {self.name}, {field}", value, size, unit))
            object.__setattr__(self, name, kind(*values))


BUILT_IN = (NamedPose("center", Joints(0.0, 0.2, 0.0, 0.0)),)
"""Poses that every arm has; ``center`` is that of the arm's description."""


@dataclass(frozen=True, slots=True)
class TeachTable:
    """The tools, poses and frames of one arm; immutable, a change returns another table.

    Attributes:
        fingers: The tool that the parameters describe.
        tools: Further tools.
        poses: Taught poses.
        frames: Work frames.

    Raises:
        InvalidArgumentError: A name occurs twice or is built in, or a pose has an unknown tool.
    """

    fingers: Tool
    tools: tuple[Tool, ...] = ()
    poses: tuple[NamedPose, ...] = ()
    frames: tuple[Frame, ...] = ()

    def __post_init__(self) -> None:
        for name, kind in (("tools", Tool), ("poses", NamedPose), ("frames", Frame)):
            entries = items(f"the {name} of a table", getattr(self, name))
            for entry in entries:
                _require(kind, entry)
            object.__setattr__(self, name, entries)
        _require(Tool, self.fingers)
        _refuse_twice("tool", (tool.name for tool in self.all_tools()))
        _refuse_twice("pose", (pose.name for pose in self.all_poses()))
        _refuse_twice("frame", (frame.name for frame in self.frames))
        tools = {tool.name for tool in self.all_tools()}
        for pose in self.poses:
            if pose.tool not in tools:
                complaint = unknown("tool", pose.tool, tools)
                raise InvalidArgumentError(f"pose {pose.name}: {complaint}")

    def __repr__(self) -> str:
        tools = ", ".join(tool.name for tool in self.all_tools())
        poses = ", ".join(pose.name for pose in self.all_poses())
        frames = ", ".join(frame.name for frame in self.frames) or "none"
        return f"<TeachTable tools {tools}; poses {poses}; frames {frames}>"

    def _repr_html_(self) -> str:
        rows = []
        for pose in self.all_poses():
            joints, place = pose.joints, pose.pose_tool_in_base
            rows.append(
                (
                    pose.name,
                    "" if joints is None else ", ".join(f"{value:z.3f}" for value in joints),
                    "" if place is None else str(place),
                    pose.tool,
                )
            )
        tools = [(tool.name, str(tool.pose_tool_in_flange)) for tool in self.all_tools()]
        frames = [(frame.name, str(frame.pose_frame_in_base)) for frame in self.frames]
        shown = table(rows, ("pose", "joints [rad, m, rad, rad]", "tool in the base", "tool"))
        shown += table(tools, ("tool", "in the flange"))
        return shown + table(frames, ("frame", "in the base")) if frames else shown

    def all_tools(self) -> tuple[Tool, ...]:
        """Return the fingers and the further tools."""
        return (self.fingers, *self.tools)

    def all_poses(self) -> tuple[NamedPose, ...]:
        """Return the built-in poses and the taught ones."""
        return (*BUILT_IN, *self.poses)

    def tool(self, name: str) -> Tool:
        """Return the tool of this name.

        Raises:
            InvalidArgumentError: There is none; the message proposes the nearest name.
        """
        for tool in self.all_tools():
            if isinstance(name, str) and tool.name == name:
                return tool
        raise unknown("tool", name, (tool.name for tool in self.all_tools()))

    def pose(self, name: str) -> NamedPose:
        """Return the pose of this name.

        Raises:
            InvalidArgumentError: There is none; the message proposes the nearest name.
        """
        for pose in self.all_poses():
            if isinstance(name, str) and pose.name == name:
                return pose
        raise unknown("pose", name, (pose.name for pose in self.all_poses()))

    def frame(self, name: str) -> Frame:
        """Return the frame of this name.

        Raises:
            InvalidArgumentError: There is none; the message proposes the nearest name.
        """
        for frame in self.frames:
            if isinstance(name, str) and frame.name == name:
                return frame
        if not self.frames:
            raise InvalidArgumentError(
                f"there is no frame {shown(name)}; the table has none: with_frame() adds one"
            )
        raise unknown("frame", name, (frame.name for frame in self.frames))

    def with_tool(self, tool: Tool, *, overwrite: bool = False) -> TeachTable:
        """Return the table with one more tool.

        Args:
            tool: The tool.
            overwrite: Whether it replaces another one of its name.

        Raises:
            InvalidArgumentError: There is one of this name, or it is built in.
        """
        kept = [each for each in self.tools if not (overwrite and each.name == tool.name)]
        return replace(self, tools=(*kept, tool))

    def with_pose(self, pose: NamedPose, *, overwrite: bool = False) -> TeachTable:
        """Return the table with one more pose.

        Args:
            pose: The pose.
            overwrite: Whether it replaces a taught one of its name.

        Raises:
            InvalidArgumentError: There is one of this name, it is built in, or its tool is unknown.
        """
        kept = [each for each in self.poses if not (overwrite and each.name == pose.name)]
        return replace(self, poses=(*kept, pose))

    def with_frame(self, frame: Frame) -> TeachTable:
        """Return the table with one more frame.

        Raises:
            InvalidArgumentError: There is one of this name.
        """
        return replace(self, frames=(*self.frames, frame))

    def without_pose(self, name: str) -> TeachTable:
        """Return the table without a taught pose.

        Raises:
            InvalidArgumentError: There is none, or it is built in.
        """
        self.pose(name)
        if any(pose.name == name for pose in BUILT_IN):
            raise InvalidArgumentError(f"pose {name} is built in; only taught poses can be deleted")
        return replace(self, poses=tuple(pose for pose in self.poses if pose.name != name))


def _require(kind: type[Tool] | type[NamedPose] | type[Frame], item: object) -> None:
    if not isinstance(item, kind):
        raise InvalidArgumentError(f"{shown(item)} is not a {kind.__name__}")


def _refuse_twice(what: str, names: Iterator[str]) -> None:
    seen: set[str] = set()
    for name in names:
        if name in seen:
            raise InvalidArgumentError(f"there is a {what} {name} already; choose another name")
        seen.add(name)
