"""Speed of a simulated arm in a world of bodies, and of its images."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product

from benchmarks.floors import ADDITIONS, additions
from benchmarks.measure import Row, at_most, duration, medians
from bioscara import Load, Robot
from bioscara.errors import BioscaraError, NotSupportedError
from bioscara.model import load_parameters
from bioscara.model.labware import labware_table
from bioscara.physics.stills import image_of, still_of
from bioscara.physics.world import PhysicsWorld
from bioscara.planning.world import Item, Nest, Table, World
from bioscara.sim import SimulatedArm, SimulatedServo

SPAN = 0.5
"""Simulated time of a measurement [s]."""
SETTLING = 2.0
"""Time after which bodies at rest sleep [s]."""
FEW, MANY, WHOLE = 48.0, 96.0, 12.0
"""Times that a run may take of that without bodies. Where the simulated joints alone are 480 times
faster than real time, and the whole software 72 times, these are 10 times real time with 4 plates,
5 times with 96, and 6 times."""
IMAGE = 40.0
"""Times of :data:`ADDITIONS` additions that an image may take: 10 ms where they take 0.25 ms."""
PLATE = labware_table()["microplate_96"]
PARAMETERS = load_parameters()
NESTS = tuple(Nest(name=name, x=0.35, y=y, z=0.02) for name, y in (("a", 0.25), ("b", -0.25)))


def _plate(name: str, x: float, y: float, z: float, on: str | None) -> Item:
    return Item(name=name, labware=PLATE, x=x, y=y, z=z, yaw=0.0, mass=0.05, on=on)


def _stacked() -> World:
    """Return two nests with two plates each."""
    items = []
    for nest in NESTS:
        lower, upper = f"{nest.name}1", f"{nest.name}2"
        items.append(_plate(lower, nest.x, nest.y, nest.z, nest.name))
        items.append(_plate(upper, nest.x, nest.y, nest.z + PLATE.stack_height, lower))
    table = Table(height=0.0, lower=(-0.9, -0.9), upper=(0.9, 0.9))
    return World(table=table, nests=NESTS, items=tuple(items))


def _apart(count: int) -> World:
    """Return plates that lie apart on a large table, around the arm."""
    grid = [-0.9 + 0.18 * index for index in range(11)]
    places = [(x, y) for x, y in product(grid, grid) if max(abs(x), abs(y)) > 0.25][:count]
    items = tuple(_plate(f"p{i}", x, y, 0.0, None) for i, (x, y) in enumerate(places))
    return World(table=Table(height=0.0, lower=(-2.0, -2.0), upper=(2.0, 2.0)), items=items)


def _arm(world: World) -> tuple[SimulatedArm, PhysicsWorld]:
    arm = SimulatedArm(seed=1)
    made = PhysicsWorld(arm, SimulatedServo(PARAMETERS.gripper.outputs[0]), world, PARAMETERS)
    arm.run(SETTLING)
    return arm, made


def _joints() -> list[Row]:
    """Measure joints and bodies, without drivers."""
    alone, few, many = SimulatedArm(seed=1), _arm(_stacked())[0], _arm(_apart(96))[0]
    alone.run(SETTLING)
    floor, *times = medians(
        *(lambda each=each: each.run(SPAN) for each in (alone, few, many)), rounds=15
    )
    whose = f"without bodies, {_speed(floor, SPAN)}"
    whats = ("4 plates in 2 nests", "96 plates on a table")
    return [
        at_most(f"joints and {what}, asleep: {SPAN:g} s", took, most, floor, whose,
                _speed(took, SPAN))
        for what, took, most in zip(whats, times, (FEW, MANY), strict=True)
    ]  # fmt: skip


def _whole() -> Row:
    """Measure the whole software while a plate is carried from one nest to the other."""
    world = _stacked()
    plate = world.item("a2")
    start, end = plate.grip.pose.up(0.08), world.item("b2").grip.pose.up(0.08)
    with (
        Robot.simulated(seed=1, homed=True) as alone,
        Robot.simulated(seed=1, homed=True, world=world) as robot,
    ):
        for each in (alone, robot):
            each.scene = replace(type(each.scene)(), table_height=0.0)
            each.enable()
            each.gripper.open()
            each.move_to(start)
        robot.move_linear(plate.grip.pose)
        robot.gripper.grasp(Load("plate", plate.shape_in_tool, plate.mass, ("table",)))
        robot.move_linear(start)

        def carry(each: Robot) -> None:
            each.move_to(end)
            each.move_to(start)

        begin = robot.clock.now()
        carry(robot)
        span = robot.clock.now() - begin
        floor, took = medians(lambda: carry(alone), lambda: carry(robot), rounds=5)
        if robot.simulation.held != plate.name:
            raise BioscaraError("the plate was lost")
    distance = math.dist((start.x, start.y), (end.x, end.y))
    return at_most(
        f"a plate carried over {distance:.1f} m and back, {span:.3g} s: the whole software, with 3 "
        "plates in 2 nests",
        took, WHOLE, floor, f"without bodies, {_speed(floor, span)}", _speed(took, span),
    )  # fmt: skip


def _image() -> Row:
    _, world = _arm(_stacked())
    still = still_of(world)
    what = "an image of 320x240 pixels, 4 plates in 2 nests"
    try:
        image_of(still, "front", (320, 240))
    except NotSupportedError as error:
        return Row(what, f"not measured: {error}", "", "", holds=True)
    took, floor, copied = medians(
        lambda: image_of(still, "front", (320, 240)),
        additions(),
        lambda: still_of(world),
        rounds=51,
    )
    note = f"for which the control loop waits {duration(copied)}"
    return at_most(what, took, IMAGE, floor, f"{ADDITIONS:,} additions", note)


def _speed(took: float, span: float) -> str:
    return f"{span / took:.0f} times real time"


def rows() -> list[Row]:
    """Measure the joints with bodies, the whole software, and an image."""
    return [*_joints(), _whole(), _image()]
