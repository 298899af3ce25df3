"""Tool, scene, load and speed limit of an arm, as one value."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

from bioscara.arguments import flag, shown
from bioscara.errors import InvalidArgumentError, LifecycleError, UnconfirmedError
from bioscara.kinematics import Scara
from bioscara.model import ArmParameters
from bioscara.model.parameters import JERK_TIME
from bioscara.planning.collision.scene import Scene
from bioscara.planning.motions.tool_speed import highest_commanded
from bioscara.robot.workspace.load import Load
from bioscara.robot.workspace.poses import TeachTable
from bioscara.robot.workspace.tools import Tool, fingers, kinematics_with


class WorkspacePart(Enum):
    """A part of the workspace that only a person can see."""

    SCENE = "scene"
    TOOL = "tool"
    LOAD = "load"


@dataclass(frozen=True, slots=True)
class Workspace:
    """Tool, scene, load and speed limit of an arm; immutable, a change returns another one.

    Created by :meth:`of`.

    Attributes:
        parameters: Parameters of the arm.
        table: The named tools and poses.
        tool: The mounted tool.
        kinematics: Kinematics of the arm with its tool and its load.
        scene: Surroundings to keep clear of, as given.
        surroundings: The scene with the load, and with the widths that the gripper may have now.
        reduced_speed: Whether the tool and its load keep to 250 mm/s.
        load: The carried load, or None.
        unconfirmed: Parts that are those of the owner's last run, by which name they are known:
            they are checked against, but may be wrong.
    """

    parameters: ArmParameters
    table: TeachTable
    tool: Tool
    kinematics: Scara
    scene: Scene
    surroundings: Scene
    reduced_speed: bool = True
    load: Load | None = None
    unconfirmed: frozenset[WorkspacePart] = frozenset()

    def __repr__(self) -> str:
        load = "no load" if self.load is None else f"load {self.load.name}"
        speed = "reduced" if self.reduced_speed else "full"
        return f"<Workspace tool {self.tool.name}, {load}, {speed} speed, {self.scene!r}>"

    @classmethod
    def of(cls, parameters: ArmParameters, *, reduced_speed: bool = True) -> Workspace:
        """Return the workspace of an arm with its gripper, without surroundings."""
        tool = fingers(parameters)
        scene = Scene(widths=(parameters.gripper.lower, parameters.gripper.upper))
        return cls(
            parameters,
            TeachTable(tool),
            tool,
            kinematics_with(parameters, tool),
            scene,
            scene,
            flag("reduced_speed", reduced_speed),
        )

    @property
    def windows(self) -> tuple[float, ...]:
        """Durations of the command averaging that keeps the belts from oscillating [s]."""
        return self.parameters.belt_periods[:2] if self.reduced_speed else (JERK_TIME,)

    @property
    def raw_windows(self) -> tuple[float, ...]:
        """The same for raw commands [s], which may jump to and fro in step with a belt.

        At full speed the second longest period remains: that belt's motor would stall.
        """
        first = 0 if self.reduced_speed else 1
        return self.parameters.belt_periods[first:2]

    @property
    def commanded_speed(self) -> float:
        """Highest commanded speed of the tool and its load [m/s].

        It is below the limit of the reduced speed by the overshoot of the joints; infinite without
        that limit and that of the load.
        """
        limit = highest_commanded(self.kinematics.overhang) if self.reduced_speed else math.inf
        own = None if self.load is None else self.load.max_speed
        return limit if own is None else min(limit, own)

    def with_table(self, table: TeachTable) -> Workspace:
        """Return the workspace with other tools and poses; the mounted tool is as the table has it.

        The fingers are those of the parameters, whatever the table has.

        Raises:
            InvalidArgumentError: It is no table, or has no tool of the name of the mounted one.
            LifecycleError: It changes the mounted tool, which carries a load.
        """
        if not isinstance(table, TeachTable):
            raise InvalidArgumentError(f"the table is {shown(table)}; give a TeachTable")
        name, own = self.tool.name, fingers(self.parameters)
        if table.fingers != own:
            # A table read for another arm would displace every pose.
            table = replace(table, fingers=own)
        if all(tool.name != name for tool in table.all_tools()):
            raise InvalidArgumentError(
                f"the table has no tool {name}, which is mounted; add it, or set another tool first"
            )
        changed = replace(self, table=table)
        return changed if table.tool(name) == self.tool else changed.with_tool(name)

    def with_tool(self, tool: str | Tool) -> Workspace:
        """Return the workspace with another tool of the table mounted.

        Args:
            tool: The tool, or its name.

        Raises:
            InvalidArgumentError: No tool has that name, or that of the table is another one.
            LifecycleError: The mounted tool carries a load.
        """
        found = self.table.tool(tool.name if isinstance(tool, Tool) else tool)
        if isinstance(tool, Tool) and tool != found:
            raise InvalidArgumentError(
                f"tool {tool.name} is another one in the table; change it there first: "
                "table.with_tool(tool, overwrite=True)"
            )
        if self.load is not None:
            raise LifecycleError(f"the tool carries {self.load.name}; detach() it first")
        return _arranged(self._confirmed(WorkspacePart.TOOL, tool=found), self.widths)

    def with_scene(self, scene: Scene) -> Workspace:
        """Return the workspace with other surroundings.

        Raises:
            InvalidArgumentError: It is no scene.
        """
        if not isinstance(scene, Scene):
            raise InvalidArgumentError(f"the scene is {shown(scene)}; give Scene(...)")
        return _arranged(self._confirmed(WorkspacePart.SCENE, scene=scene), self.widths)

    def with_load(self, load: Load) -> Workspace:
        """Return the workspace in which the tool carries a load.

        Raises:
            InvalidArgumentError: It is no load, or may touch a zone that is not in the scene.
            LifecycleError: The tool carries a load already.
        """
        if not isinstance(load, Load):
            raise InvalidArgumentError(f"the load is {shown(load)}; give Load(name, shape)")
        if self.load is not None:
            raise LifecycleError(f"the tool carries {self.load.name} already; detach() it first")
        return _arranged(self._confirmed(WorkspacePart.LOAD, load=load), self.widths)

    def without_load(self) -> Workspace:
        """Return the workspace in which the tool carries nothing.

        Raises:
            LifecycleError: It carries nothing now.
        """
        if self.load is None:
            raise LifecycleError("the tool carries no load; attach(load) declares one")
        return _arranged(self._confirmed(WorkspacePart.LOAD, load=None), self.widths)

    def with_reduced_speed(self, reduced_speed: bool) -> Workspace:
        """Return the workspace with or without the limit of 250 mm/s.

        Raises:
            UnconfirmedError: Without it, and a part of the workspace is not confirmed.
        """
        if not flag("reduced_speed", reduced_speed):
            self.require_confirmed("full speed")
        return replace(self, reduced_speed=reduced_speed)

    def confirmed(self) -> Workspace:
        """Return the workspace in which a person has confirmed all parts."""
        return replace(self, unconfirmed=frozenset())

    def _confirmed(self, part: WorkspacePart, **changes: Any) -> Workspace:
        """Return the workspace with a part that is declared now."""
        return replace(self, unconfirmed=self.unconfirmed - {part}, **changes)

    def unconfirmed_words(self) -> tuple[str, ...]:
        """Return the parts that are not confirmed, in words."""
        height = self.scene.table_height
        zones = ", ".join(zone.name for zone in self.scene.zones) or "no zones"
        table = "no table" if height is None else f"a table at z = {height:g} m"
        words = {
            WorkspacePart.SCENE: f"the scene ({zones}; {table})",
            WorkspacePart.TOOL: f"the tool {self.tool.name}",
            WorkspacePart.LOAD: f"the load {self.load.name}"
            if self.load is not None
            else "the load",
        }
        return tuple(words[part] for part in WorkspacePart if part in self.unconfirmed)

    def require_confirmed(self, name: str) -> None:
        """Raise unless all parts are confirmed.

        Args:
            name: What needs that, for the message.

        Raises:
            UnconfirmedError: A part is not.
        """
        if not self.unconfirmed:
            return
        words = self.unconfirmed_words()
        what = " and ".join(words)
        detach = (
            ", or detach() a load that is gone" if WorkspacePart.LOAD in self.unconfirmed else ""
        )
        raise UnconfirmedError(
            f"{name}: {what} {'are' if len(words) > 1 else 'is'} from the owner's "
            "last run; look whether that still holds, then confirm_scene() or 'bioscara confirm', "
            "or set another one"
            f"{detach}; until then the arm only jogs, at reduced speed",
            what,
        )

    @property
    def widths(self) -> tuple[float, float]:
        """Smallest and largest width that the gripper may have now [m]."""
        return self.surroundings.widths

    def with_widths(self, low: float, high: float) -> Workspace:
        """Return the workspace of a gripper that may have other widths [m]."""
        # The same scene as long as nothing changes, so that its precomputed data stay valid.
        if self.widths == (low, high):
            return self
        return _arranged(self, (low, high))


def _arranged(workspace: Workspace, widths: tuple[float, float]) -> Workspace:
    """Return the workspace with surroundings and kinematics of its tool, scene and load."""
    scene, tool = replace(workspace.scene, widths=widths), workspace.tool.pose_tool_in_flange
    if (load := workspace.load) is not None:
        scene = scene.carrying(load.shape_in_wrist(tool), load.touches)
    kinematics = kinematics_with(workspace.parameters, workspace.tool, scene.overhang(tool))
    return replace(workspace, surroundings=scene, kinematics=kinematics)
