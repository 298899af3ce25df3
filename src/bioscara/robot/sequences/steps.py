"""The steps of a sequence, and the sequence; each is checked when it is made."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import MISSING, fields
from typing import Annotated, ClassVar

from bioscara.arguments import shown
from bioscara.errors import ConfigurationError, InvalidArgumentError
from bioscara.kinematics import Joints, Pose
from bioscara.kinematics.pose import ANGLE_MAX, PLACE_MAX
from bioscara.model.validation import (
    AS_TUPLE,
    Before,
    Checked,
    Listed,
    Problem,
    Strict,
    Text,
    Within,
)
from bioscara.planning.collision.shapes import Prism
from bioscara.planning.limits import SLOWEST
from bioscara.planning.motions.waypoints import LEAST_BLEND
from bioscara.robot.workspace.load import Load
from bioscara.robot.workspace.tools import FINGERS, MASS_MAX, OFFSET_MAX, check_name
from bioscara.spelling import did_you_mean

SCHEMA = 1
"""Version of the schema of sequences."""
STEPS_MAX = 200
"""Most steps of a sequence: a YAML file with so many is read in a second."""
WAIT_MAX = 3600.0
"""Longest wait [s]."""
_TITLE_MAX = 100
_TOUCHES_MAX = 10


def _valid_name(value: object) -> object:
    if isinstance(value, str):
        try:
            check_name("the", value)
        except InvalidArgumentError as error:
            raise ValueError(str(error).removeprefix("the name ")) from None
    return value


def _one_line(value: object) -> object:
    if isinstance(value, str) and (len(value) > _TITLE_MAX or not (value + "x").isprintable()):
        raise ValueError(f"it must be one printable line of at most {_TITLE_MAX} characters")
    return value


_Angle = Annotated[float, Within(-ANGLE_MAX, ANGLE_MAX, "rad")]
_Length = Annotated[float, Within(-PLACE_MAX, PLACE_MAX, "m")]
_Offset = Annotated[float, Within(-OFFSET_MAX, OFFSET_MAX, "m")]
_Share = Annotated[float, Within(SLOWEST, 1.0)]
_Blend = Annotated[float, Within(0.0, 1.0, "m")]
_Width = Annotated[float, Within(0.0, OFFSET_MAX, "m")]
_EntryName = Annotated[str, Strict(), Before(_valid_name)]
_Corner = Annotated[tuple[_Offset, _Offset, _Offset], Strict(), AS_TUPLE]


class JointPositions(Checked):
    """Positions of the joints [rad, m, rad, rad]."""

    j1: _Angle
    j2: _Length
    j3: _Angle
    j4: _Angle

    @property
    def joints(self) -> Joints:
        """The same, as the rest of the software has them."""
        return Joints(self.j1, self.j2, self.j3, self.j4)


class Place(Checked):
    """A pose of the tool [m, m, m, rad], in the base or in the frame that the step names."""

    x: _Length
    y: _Length
    z: _Length
    yaw: _Angle = 0.0

    @property
    def pose(self) -> Pose:
        """The same, as the rest of the software has it."""
        return Pose(self.x, self.y, self.z, self.yaw)


class Step(Checked):
    """Base of the steps.

    Attributes:
        KIND: Its name in a file.
    """

    KIND: ClassVar[str] = ""


class MotionStep(Step):
    """A step that moves the arm.

    Attributes:
        speed: Share of the speed limits to use, 0.001 to 1.
    """

    speed: _Share = 1.0


class JointsStep(MotionStep):
    """All joints to positions; they start and end together."""

    KIND: ClassVar[str] = "move_joints"

    joints: JointPositions


class NamedStep(MotionStep):
    """To a pose of the teach table; if it was taught with joints, these are the goal."""

    KIND: ClassVar[str] = "move_named"

    name: _EntryName


class _PoseStep(MotionStep):
    """A step to a pose of the tool: given by numbers, or the name of a taught pose.

    Attributes:
        pose: The pose.
        name: Name of the taught pose, instead; one of the two is given.
        frame: Name of the work frame in which ``pose`` and ``via`` are given; the base without it.
    """

    pose: Place | None = None
    name: _EntryName | None = None
    frame: _EntryName | None = None

    def problems(self) -> Iterator[Problem]:
        """Yield a target that is missing or given twice."""
        if (self.pose is None) == (self.name is None):
            yield Problem("give a pose, or the name of one in the teach table", ("pose",))
        if self.frame is not None and self.pose is None and getattr(self, "via", None) is None:
            yield Problem("a taught pose is in the base; leave the frame out", ("frame",))


class PointToPointStep(_PoseStep):
    """To a pose by the closest joint solution; the path of the tool is a curve."""

    KIND: ClassVar[str] = "move_to"


class PathStep(_PoseStep):
    """A step along a path of the tool.

    Attributes:
        blend: Distance from the goal at which the tool may leave the path for that of the next
            step [m]; 0 rests at the goal.
    """

    blend: _Blend = 0.0

    def problems(self) -> Iterator[Problem]:
        """Yield a target or a blend that is not possible."""
        yield from super().problems()
        if 0.0 < self.blend < LEAST_BLEND:
            text = f"{self.blend:g} m is below {LEAST_BLEND:g} m; 0 rests at the goal"
            yield Problem(text, ("blend",))


class LineStep(PathStep):
    """To a pose along a straight line of the tool."""

    KIND: ClassVar[str] = "move_linear"


class ArcStep(PathStep):
    """To a pose along an arc of the tool.

    Attributes:
        via: A point on the arc; its yaw is not used.
        via_name: Name of a taught pose there, instead; one of the two is given.
    """

    KIND: ClassVar[str] = "move_circular"

    via: Place | None = None
    via_name: _EntryName | None = None

    def problems(self) -> Iterator[Problem]:
        """Yield a target, via or blend that is not possible."""
        yield from super().problems()
        if (self.via is None) == (self.via_name is None):
            yield Problem("give a point on the arc, or the name of a pose there", ("via",))


class GripperStep(Step):
    """The jaws to a width [m]."""

    KIND: ClassVar[str] = "gripper_move"

    width: _Width


class OpenStep(Step):
    """The jaws to their largest width."""

    KIND: ClassVar[str] = "gripper_open"


class CloseStep(Step):
    """The jaws to their smallest width."""

    KIND: ClassVar[str] = "gripper_close"


class LoadBox(Checked):
    """A load: a box in the frame of the tool centre point; see :class:`bioscara.Load`.

    Attributes:
        name: Its name.
        lower: Smallest x, y, z [m].
        upper: Largest x, y, z [m].
        yaw: Rotation about its centre [rad].
        mass: [kg].
        touches: Zones, or ``"table"``, that it may touch.
        max_speed: Highest commanded speed of its fastest point [m/s]; None for no own limit.
    """

    name: _EntryName
    lower: _Corner
    upper: _Corner
    yaw: _Angle = 0.0
    mass: Annotated[float, Within(0.0, MASS_MAX, "kg")] = 0.0
    touches: Listed[Text] = ()
    max_speed: Annotated[float, Within(SLOWEST, 10.0, "m/s")] | None = None

    def problems(self) -> Iterator[Problem]:
        """Yield the errors of a load."""
        if len(self.touches) > _TOUCHES_MAX:
            yield Problem(f"{len(self.touches)} names, at most {_TOUCHES_MAX}", ("touches",))
        for axis, low, high in zip("xyz", self.lower, self.upper, strict=True):
            if not low < high:
                text = f"its {axis}, {high:g} m, must be above that of lower, {low:g} m"
                yield Problem(text, ("upper",))
                return
        try:
            self.made()
        except InvalidArgumentError as error:
            yield Problem(str(error))

    def made(self) -> Load:
        """Return the load."""
        shape = Prism.between(self.lower, self.upper, self.yaw)
        return Load(self.name, shape, self.mass, self.touches, self.max_speed)


class GraspStep(Step):
    """Close the jaws on a load and attach it.

    Attributes:
        load: The load.
        width: Its width between the jaws [m]; None for that of its shape.
        squeeze: By how much the commanded width is smaller [m]; None for the usual one.
    """

    KIND: ClassVar[str] = "grasp"

    load: LoadBox
    width: _Width | None = None
    squeeze: _Width | None = None


class ReleaseStep(Step):
    """Open the jaws and detach the load.

    Attributes:
        opening: By how much they open [m]; None for the usual one.
    """

    KIND: ClassVar[str] = "release"

    opening: _Width | None = None


class WaitStep(Step):
    """Rest for a time [s]."""

    KIND: ClassVar[str] = "wait"

    seconds: Annotated[float, Within(0.0, WAIT_MAX, "s")]


KINDS: dict[str, type[Step]] = {
    kind.KIND: kind
    for kind in (
        JointsStep, NamedStep, PointToPointStep, LineStep, ArcStep, GripperStep, OpenStep,
        CloseStep, GraspStep, ReleaseStep, WaitStep,
    )
}  # fmt: skip
"""The kinds of steps, by their names in a file."""


def _step(values: object) -> object:
    """Return the step of values that name their kind."""
    if not isinstance(values, Mapping):
        return values
    kind = values.get("kind")
    if not isinstance(kind, str) or kind not in KINDS:
        hint = f"there are {', '.join(KINDS)}"
        if isinstance(kind, str):
            raise ValueError(f"there is no kind {kind!r}; {did_you_mean(kind, KINDS, hint)}")
        raise ValueError(f"it needs a kind; {hint}")
    return KINDS[kind].parsed({key: value for key, value in values.items() if key != "kind"})


class StepSequence(Checked):
    """Steps in the order in which they are carried out.

    Attributes:
        schema: Version of the schema.
        title: A description for people.
        tool: Name of the tool that it is for: with another one mounted it is refused.
        steps: The steps.
    """

    schema: Annotated[int, Within(1, 10**6)] = SCHEMA
    title: Annotated[str, Strict(), Before(_one_line)] = ""
    tool: _EntryName = FINGERS
    steps: Listed[Annotated[Step, Before(_step)]]

    def problems(self) -> Iterator[Problem]:
        """Yield no or too many steps, and blends at places where the arm has to rest."""
        if not self.steps:
            yield Problem("there is none; a sequence has at least one step", ("steps",))
        if len(self.steps) > STEPS_MAX:
            yield Problem(f"{len(self.steps)} steps, at most {STEPS_MAX}; divide them", ("steps",))
        for index, step in enumerate(self.steps):
            if not (isinstance(step, PathStep) and step.blend):
                continue
            following = self.steps[index + 1 : index + 2]
            if not (following and isinstance(following[0], PathStep)):
                why = "the next step is no line or arc" if following else "it is the last step"
                text = f"{step.blend:g} m, but {why}, so that the arm rests there; give blend 0"
                yield Problem(text, ("steps", index, "blend"))

    def runs(
        self, first: int = 0, last: int | None = None
    ) -> Iterator[tuple[int, tuple[Step, ...]]]:
        """Yield the steps, those joined by blends together, with the index of the first one.

        Args:
            first: Index of the step to begin with.
            last: Index of the step to end before; None for all.
        """
        steps = self.steps[:last]
        begin = first
        for index, step in enumerate(steps[first:], first):
            if not (isinstance(step, PathStep) and step.blend) or index + 1 == len(steps):
                yield begin, steps[begin : index + 1]
                begin = index + 1


def require_tool(sequence: StepSequence, mounted: str) -> None:
    """Raise unless the tool of a sequence is mounted.

    Raises:
        InvalidArgumentError: Another one is; names the remedy.
    """
    if sequence.tool != mounted:
        raise InvalidArgumentError(
            f"the sequence is for tool {sequence.tool}, the arm has {mounted}; set robot.tool = "
            f"{sequence.tool!r} once that is mounted, or --tool {sequence.tool}"
        )


def values_of(sequence: StepSequence) -> dict[str, object]:
    """Return a sequence as plain values, without those that are the default."""
    values: dict[str, object] = {"schema": sequence.schema}
    if sequence.title:
        values["title"] = sequence.title
    values["tool"] = sequence.tool
    values["steps"] = [{"kind": step.KIND, **_plain(step)} for step in sequence.steps]
    return values


def _plain(group: Checked) -> dict[str, object]:
    values: dict[str, object] = {}
    for each in fields(group):
        value = getattr(group, each.name)
        # Poses are written whole: four numbers are easier to read than three.
        if each.default is not MISSING and value == each.default and not isinstance(group, Place):
            continue
        if isinstance(value, Checked):
            values[each.name] = _plain(value)
        else:
            values[each.name] = list(value) if isinstance(value, tuple) else value
    if "speed" in values:
        # The field of the base comes first; people look for the target there.
        values["speed"] = values.pop("speed")
    return values


def sequence_of(values: object) -> StepSequence:
    """Return the sequence of plain values, as a browser sends them.

    Raises:
        ConfigurationError: A value cannot be used; the message names the step, counted from 1.
    """
    if isinstance(values, Mapping) and values.get("schema", SCHEMA) != SCHEMA:
        raise ConfigurationError(
            f"schema {shown(values['schema'])} cannot be read; this version of bioscara reads "
            f"{SCHEMA}"
        )

    def name(location: tuple[str | int, ...]) -> str:
        match location:
            case ("steps", int(index), *rest):
                return " ".join([f"step {index + 1}", *(str(each) for each in rest)])
        return ".".join(map(str, location))

    return StepSequence.checked(values, lambda _: "", name)
