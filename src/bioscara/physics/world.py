"""The world around one simulated arm."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from bioscara.arguments import number, numbers, text
from bioscara.errors import ConfigurationError, InvalidArgumentError, LifecycleError, LimitError
from bioscara.kinematics import Geometry
from bioscara.model import ArmParameters
from bioscara.physics.arm_model import LEFT, RIGHT, add_arm, jaw_boxes
from bioscara.physics.bodies import BodyBox, BodyPose, BodyShape
from bioscara.physics.coupling import BodyPush, Coupling, LinkPush, Tilting, allow_sleep
from bioscara.physics.engine import mujoco
from bioscara.physics.servo_force import ServoForce, ServoState
from bioscara.physics.world_model import add_fixed, add_fixed_body, add_item, new_model
from bioscara.planning.arrays import Array
from bioscara.planning.world import World
from bioscara.sim.servo import SimulatedServo
from bioscara.sim.simulated_arm import JOINTS, ArmSnapshot, SimulatedArm
from bioscara.spelling import did_you_mean

DEEPEST = 1e-3
"""How deep a body may be in another one at the beginning [m]."""
FORCE_MAX, DURATION_MAX, TILT_MAX = 50.0, 10.0, 0.02
"""Largest force [N], longest time [s] and largest tilt [m] of a disturbance."""
BODIES_MAX = 300
"""Most bodies of a world, with obstacles that are added."""
_TILTING = 0.3
"""Time in which a body is tilted [s]: labware on it is not thrown."""
_ARM = ("base", "link_1", "link_2", "link_3", "link_4", LEFT, RIGHT)
LINKS = _ARM[1:5]
"""Names of the links that can be pushed."""


class WorldSnapshot(NamedTuple):
    """The state of an arm and of its world at one time.

    Attributes:
        arm: Of the arm.
        revision: Which bodies there are: snapshots fit one set of them.
        state: Of the engine.
        tilts: Rotations of the bodies in their parents.
        servo: Of the gripper's servo.
    """

    arm: ArmSnapshot
    revision: object
    state: Any
    tilts: Any
    servo: ServoState


class PhysicsWorld:
    """Bodies around a simulated arm: they are pushed by it, and push it.

    All methods are for the thread in which the arm's time passes.

    Args:
        arm: The arm; it meets the world in each slice of its time from now on.
        servo: The servo of its gripper.
        world: Its surroundings.
        parameters: Parameters of the arm.

    Attributes:
        shapes: The bodies; replaced as a whole, so that any thread may read it.

    Raises:
        NotSupportedError: The physics engine is not installed.
        ConfigurationError: A body is inside the arm or inside another one.
    """

    def __init__(
        self, arm: SimulatedArm, servo: SimulatedServo, world: World, parameters: ArmParameters
    ) -> None:
        self._engine = mujoco()
        self._arm = arm
        lengths = parameters.geometry
        geometry = Geometry(lengths.upper_arm, lengths.forearm, lengths.height)
        self._spec = new_model()
        inertias = [arm.load_inertia(joint) for joint in JOINTS]
        add_arm(self._spec, geometry, inertias, parameters.gripper)
        shapes = add_fixed(self._spec, world)
        shapes += [add_item(self._spec, item) for item in world.items]
        shapes += [BodyShape(name, "jaw", True, boxes) for name, boxes in jaw_boxes().items()]
        self.shapes: tuple[BodyShape, ...] = tuple(shapes)
        model = self._spec.compile()
        data = self._engine.MjData(model)
        data.qpos[:4] = [arm.position(joint) for joint in JOINTS]
        half = parameters.gripper.initial / 2.0
        for jaw in (LEFT, RIGHT):
            data.joint(jaw).qpos[0] = half
        self._coupling = Coupling(model, data, ServoForce(model, data, servo, parameters.gripper))
        self._revision = object()
        self._level: dict[str, Any] = {}
        self._engine.mj_forward(model, data)
        allow_sleep(model.opt, allowed=True)
        self._check_overlaps()
        self._couple()

    @property
    def model(self) -> Any:
        """The engine's model, a ``mujoco.MjModel``; another one once bodies come or go."""
        return self._coupling.model

    @property
    def data(self) -> Any:
        """Its state, a ``mujoco.MjData``."""
        return self._coupling.data

    @property
    def width(self) -> float:
        """True width between the jaws [m]."""
        return float(self.data.joint(LEFT).qpos[0] + self.data.joint(RIGHT).qpos[0])

    @property
    def held(self) -> str | None:
        """Name of the body that both jaws press on; None if there is none."""
        pressed = [self._touching(jaw) for jaw in (LEFT, RIGHT)]
        both = pressed[0] & pressed[1]
        return min(both) if both else None

    def poses(self) -> tuple[BodyPose, ...]:
        """Return where the bodies are, in the order of the shapes."""
        bodies = ((shape.name, self.data.body(shape.name)) for shape in self.shapes)
        return tuple(
            [BodyPose(name, *body.xpos.tolist(), *body.xquat.tolist()) for name, body in bodies]
        )

    def save(self) -> WorldSnapshot:
        """Return the state of the arm and of the bodies."""
        kind = self._engine.mjtState.mjSTATE_INTEGRATION
        state = np.empty(self._engine.mj_stateSize(self.model, kind))
        self._engine.mj_getState(self.model, self.data, state, kind)
        return WorldSnapshot(
            self._arm.save(), self._revision, state, self.model.body_quat.copy(),
            self._coupling.servo.state,
        )  # fmt: skip

    def restore(self, snapshot: WorldSnapshot) -> None:
        """Return to a state; running pushes end.

        Args:
            snapshot: Of :meth:`save`.

        Raises:
            InvalidArgumentError: It is of another world, or bodies came or went since.
        """
        self.require_fits(snapshot)
        self._arm.restore(snapshot.arm)
        kind = self._engine.mjtState.mjSTATE_INTEGRATION
        self._coupling.before, self._coupling.after = [], []
        self.model.body_quat[:] = snapshot.tilts
        self._engine.mj_setState(self.model, self.data, snapshot.state, kind)
        self.data.xfrc_applied[:] = 0.0
        self._coupling.servo.state = snapshot.servo
        allow_sleep(self.model.opt, allowed=False)
        self._engine.mj_kinematics(self.model, self.data)
        allow_sleep(self.model.opt, allowed=True)

    def require_fits(self, snapshot: WorldSnapshot) -> None:
        """Make sure that a snapshot is of this world, with the bodies of now.

        Raises:
            InvalidArgumentError: It is not.
        """
        if not isinstance(snapshot, WorldSnapshot) or snapshot.revision is not self._revision:
            raise InvalidArgumentError(
                "the snapshot is of another world, or bodies came or went since; save() a new one"
            )

    def push(self, name: str, force: Sequence[float], duration: float) -> None:
        """Push a body or a link of the arm.

        Args:
            name: Name of a piece of labware, or ``link_1`` to ``link_4``.
            force: x, y, z in the base frame [N].
            duration: [s].

        Raises:
            InvalidArgumentError: There is no such body, it is fixed, or a value is not finite.
            LimitError: A value is outside its range.
        """
        vector = _vector("force", force)
        most = float(np.abs(vector).max())
        if most > FORCE_MAX:
            raise LimitError("force", most, 0.0, FORCE_MAX, "N")
        duration = number("duration", duration)
        if not 0.0 < duration <= DURATION_MAX:
            raise LimitError("duration", duration, 0.0, DURATION_MAX, "s")
        if name in LINKS:
            link = self.model.body(name).id
            self._coupling.after.append(LinkPush(self.model, link, vector, duration))
            return
        shape = self._shape(name, LINKS)
        if not shape.movable or shape.kind == "jaw":
            raise InvalidArgumentError(
                f"{name} is fixed; push labware, or {', '.join(LINKS)}, or tilt() it"
            )
        body = self.model.body(name).id
        self._coupling.before.append(BodyPush(body, vector, duration))

    def tilt(self, name: str, height: float, direction: float = 0.0) -> None:
        """Tilt a nest, a wall or an obstacle about its origin.

        Args:
            name: Its name.
            height: By how much the end of a plate that lies on it is raised [m]; 0 ends it.
            direction: Direction of that end, from the body's x axis [rad].

        Raises:
            InvalidArgumentError: There is no such body, it moves freely, or a value is not finite.
            LimitError: The height is outside its range.
        """
        shape = self._shape(name)
        height, direction = number("height", height), number("direction", direction)
        if not 0.0 <= height <= TILT_MAX:
            raise LimitError("height", height, 0.0, TILT_MAX, "m")
        if shape.movable:
            raise InvalidArgumentError(f"{name} moves freely; push() it, or tilt what it stands on")
        body = self.model.body(name)
        angle = math.asin(height / _PLATE)
        half = angle / 2.0
        level = self._level.setdefault(name, self.model.body_quat[body.id].copy())
        about = (math.cos(half), math.sin(half) * math.sin(direction),
                 -math.sin(half) * math.cos(direction), 0.0)  # fmt: skip
        end = np.empty(4)
        self._engine.mju_mulQuat(end, level, np.array(about))
        self._coupling.before.append(Tilting(self.model, body.id, end, _TILTING))
        # For the model that is made when bodies come or go.
        self._spec.body(name).quat = end.tolist()

    def add_obstacle(self, name: str, lower: Sequence[float], upper: Sequence[float]) -> None:
        """Put a fixed box into the world.

        Args:
            name: A new name.
            lower: Smallest x, y, z in the base frame [m].
            upper: Largest x, y, z [m].

        Raises:
            InvalidArgumentError: The name is taken, a value is not finite, or the box is inside the
                arm or another body.
            LimitError: There are too many bodies.
        """
        if text("name of the obstacle", name) in (*_ARM, *(shape.name for shape in self.shapes)):
            raise InvalidArgumentError(f"there is a body {name} already; choose another name")
        low, high = _vector(f"{name}, lower", lower), _vector(f"{name}, upper", upper)
        if not ((low < high).all() and float(np.abs([low, high]).max()) <= 10.0):
            raise InvalidArgumentError(
                f"{name}: its lower corner has to be below the upper one, and both within 10 m"
            )
        if len(self.shapes) >= BODIES_MAX:
            raise LimitError("bodies of the world", len(self.shapes) + 1, 0, BODIES_MAX, "")
        half, centre = (high - low) / 2.0, (low + high) / 2.0
        box = BodyBox(0.0, 0.0, 0.0, *half.tolist())
        shape = BodyShape(name, "obstacle", False, (box,))
        add_fixed_body(self._spec, shape, centre.tolist(), 0.0)
        before = self.shapes
        self._recompile((*before, shape))
        try:
            self._check_overlaps(name)
        except ConfigurationError as error:
            self._spec.delete(self._spec.body(name))
            self._recompile(before)
            raise InvalidArgumentError(str(error)) from error

    def take_away(self, name: str) -> None:
        """Take labware, a nest, a wall or an obstacle out of the world.

        Args:
            name: Its name.

        Raises:
            InvalidArgumentError: There is no such body.
            LifecycleError: The jaws hold it.
        """
        shape = self._shape(name)
        if name in self._touching(LEFT) | self._touching(RIGHT):
            raise LifecycleError(f"the jaws hold {name}; release it before it is taken away")
        self._spec.delete(self._spec.body(name))
        self._recompile(tuple(each for each in self.shapes if each is not shape))

    def _shape(self, name: str, others: Sequence[str] = ()) -> BodyShape:
        for shape in self.shapes:
            if shape.name == text("name of the body", name) and shape.kind != "jaw":
                return shape
        names = [shape.name for shape in self.shapes if shape.kind != "jaw"] + list(others)
        hint = did_you_mean(name, names, f"there are {', '.join(names)}")
        raise InvalidArgumentError(f"there is no body {name!r} in the world; {hint}")

    def _recompile(self, shapes: tuple[BodyShape, ...]) -> None:
        """Use the model as it was changed; bodies that stay keep their state, and pushes end."""
        coupling = self._coupling
        model, data = self._spec.recompile(coupling.model, coupling.data)
        data.xfrc_applied[:] = 0.0
        coupling.servo.bind(model, data)
        self._coupling = Coupling(model, data, coupling.servo)
        self.shapes, self._revision = shapes, object()
        allow_sleep(model.opt, allowed=False)
        self._engine.mj_forward(model, data)
        allow_sleep(model.opt, allowed=True)
        self._couple()

    def _couple(self) -> None:
        data, coupling = self.data, self._coupling
        self._arm.set_world(
            data.qpos[:4], data.qvel[:4], data.qfrc_applied[:4], coupling.contact, coupling.step
        )

    def _touching(self, jaw: str) -> set[str]:
        """Return the names of the bodies that a jaw presses on."""
        model, data, force = self.model, self.data, np.zeros(6)
        number_, found = model.body(jaw).id, set()
        pairs = model.geom_bodyid[data.contact.geom].reshape(-1, 2)
        labware = {shape.name for shape in self.shapes if shape.kind == "labware"}
        for index in np.flatnonzero((pairs == number_).any(axis=1)).tolist():
            name = model.body(int(pairs[index][pairs[index] != number_][0])).name
            self._engine.mj_contactForce(model, data, index, force)
            if name in labware and force[0] > 0.0:
                found.add(name)
        return found

    def _check_overlaps(self, name: str = "") -> None:
        """Make sure that no body is deep in another one, or the one of this name."""
        model, data = self.model, self.data
        for index in range(data.ncon):
            contact = data.contact[index]
            one, other = (model.body(body).name for body in model.geom_bodyid[contact.geom])
            if one in _ARM:
                one, other = other, one
            if contact.dist < -DEEPEST and one not in _ARM and name in ("", one, other):
                what = f"the arm's {other}" if other in _ARM else other
                raise ConfigurationError(
                    f"{one} is {-1e3 * contact.dist:.1f} mm deep in {what}, with j1 to j4 at "
                    f"{', '.join(f'{q:.3f}' for q in data.qpos[:4])}; at most "
                    f"{1e3 * DEEPEST:g} mm can be: move it"
                )


def _vector(what: str, values: Sequence[float]) -> Array:
    """Return x, y, z as an array.

    Raises:
        InvalidArgumentError: They are not three finite numbers.
    """
    found = numbers(what, values, "give x, y, z")
    if len(found) != 3:
        raise InvalidArgumentError(f"{what} has {len(found)} values; give x, y, z")
    return np.array(found, dtype=np.float64)


_PLATE = 0.12776
"""Length over which a tilt is given [m]: that of a plate."""
