"""Drawing of the arm: the convex parts of each link.

Outer dimensions are those of the existing arm's links; the inside is drawn to make the arm
recognisable, and is no manufacturing data. Metres, in the frames of the description.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

from bioscara.model.solids import Solid, box, capsule, cylinder, prism

PLA = 1240.0
"""Density of the printed material [kg/m^3]."""
STEEL, ALUMINIUM, RUBBER = 7850.0, 2700.0, 1200.0
"""Densities [kg/m^3]."""
MOTOR = 4000.0
"""Density of a stepper motor: 0.28 kg in 42 x 42 x 40 mm [kg/m^3]."""
SERVO = 1350.0
"""Density of the gripper's servo [kg/m^3]."""

MASSES = (
    "Masses, centres of mass and inertias are estimates from the drawing of the arm "
    "(bioscara.model.parts), not measured: printed parts are shells of PLA (1240 kg/m3) with 4 mm "
    "of wall and infill; motors have 4000 kg/m3, rods are steel, plates aluminium, the servo has "
    "1350 kg/m3; screws, belts and cables are missing."
)
"""Where the masses of the description come from, for its readers."""


class Part(NamedTuple):
    """One part of a link.

    Attributes:
        solid: Its shape.
        density: Density of its material [kg/m^3].
        printed: Whether it is printed, thus a shell, or solid.
    """

    solid: Solid
    density: float
    printed: bool


@dataclass(frozen=True, slots=True)
class Link:
    """One link of the arm.

    Attributes:
        name: As in the description, without a prefix.
        bodies: Its convex parts by the name of the body they form; contact with a part is contact
            with the link.
    """

    name: str
    bodies: dict[str, tuple[Part, ...]]

    @property
    def parts(self) -> tuple[Part, ...]:
        """All of its parts."""
        return tuple(part for parts in self.bodies.values() for part in parts)


def _printed(*solids: Solid) -> tuple[Part, ...]:
    return tuple(Part(solid, PLA, printed=True) for solid in solids)


def _solid(density: float, *solids: Solid) -> tuple[Part, ...]:
    return tuple(Part(solid, density, printed=False) for solid in solids)


def _base() -> Link:
    back = box((-0.205, -0.1222, 0.0), (-0.04, 0.1222, 0.0623))
    motor = box((-0.19, -0.021, 0.04), (-0.148, 0.021, 0.08))
    disc = cylinder((0, 0), 0.115, 0.0, 0.08)
    # The column turns half a millimetre above it: bodies that touch would rub in a simulator.
    plate = cylinder((0, 0), 0.095, 0.08, 0.0868)
    return Link(
        "base_link",
        {
            "back": (*_printed(back), *_solid(MOTOR, motor)),
            "disc": (*_printed(disc), *_solid(ALUMINIUM, plate)),
        },
    )


def _column() -> Link:
    rods = (cylinder((0.045, side), 0.006, -0.02, 0.495) for side in (-0.035, 0.035))
    screw = cylinder((0.02, 0), 0.004, -0.02, 0.495)
    back = (
        box((-0.1513, -0.06, -0.0477), (-0.0876, 0.06, 0.142)),
        box((-0.0876, -0.07, -0.02), (-0.068, 0.07, 0.495)),
        box((-0.1513, -0.05, 0.495), (-0.0876, 0.05, 0.5213)),
    )
    motor = box((-0.1513, -0.021, 0.455), (-0.1093, 0.021, 0.495))
    return Link(
        "link_1",
        {
            "bottom": _printed(cylinder((0, 0), 0.1119, -0.0477, -0.02)),
            "top": _printed(cylinder((0, 0), 0.1119, 0.495, 0.5213)),
            "back": (*_printed(*back), *_solid(MOTOR, motor)),
            "rods": _solid(STEEL, *rods, screw),
        },
    )


def _upper_arm(length: float) -> Link:
    carriage = box((0, -0.0528, -0.0132), (0.0856, 0.0528, 0.1279))
    profile = ((0.0856, -0.0132), (0.156, 0.0426), (0.0856, 0.0426))
    # Outlines perpendicular to y are given as z, x.
    gusset = prism([(z, x) for x, z in reversed(profile)], -0.03, 0.03, "y")
    motor = box((0.1, -0.021, 0.0879), (0.142, 0.021, 0.1279))
    return Link(
        "link_2",
        {
            "carriage": (*_printed(carriage, gusset), *_solid(MOTOR, motor)),
            "bar": _printed(capsule(0.06, length, 0.0528, 0.0426, 0.1069)),
        },
    )


def _forearm(length: float) -> Link:
    bar = capsule(0.0, length, 0.0359, 0.1109, 0.1632)
    motor = box((length - 0.09, -0.021, 0.0709), (length - 0.048, 0.021, 0.1109))
    hub = cylinder((length, 0), 0.032, 0.0155, 0.1109)
    bearing = cylinder((0, 0), 0.03, 0.1069, 0.1109)
    parts = (*_printed(bar, hub), *_solid(STEEL, bearing), *_solid(MOTOR, motor))
    return Link("link_3", {"bar": parts})


def _wrist() -> Link:
    post = box((-0.0215, -0.014, 0.006), (0.0215, 0.014, 0.1555))
    plate = box((-0.0215, -0.014, 0.0021), (0.0215, 0.014, 0.006))
    return Link("link_4", {"post": (*_printed(post), *_solid(ALUMINIUM, plate))})


def _gripper() -> Link:
    rails = (cylinder((side, -0.075), 0.004, -0.086, 0.086, "x") for side in (-0.015, 0.015))
    body = (
        box((-0.03, -0.0277, -0.014), (0.03, 0.0277, 0.0069)),
        box((-0.086, -0.0277, -0.0606), (0.086, 0.0277, -0.014)),
        # They reach into the body: parts that had an edge in common would be no closed surface.
        box((-0.086, -0.0277, -0.089), (-0.081, 0.0277, -0.06)),
        box((0.081, -0.0277, -0.089), (0.086, 0.0277, -0.06)),
    )
    servo = box((-0.02, 0.0277, -0.06), (0.02, 0.0371, -0.02))
    parts = (*_printed(*body), *_solid(STEEL, *rails), *_solid(SERVO, servo))
    return Link("grp_base_link", {"body": parts})


def _jaw(name: str, side: float, rack_at: float) -> Link:
    """Return a jaw whose face is at x = 0; ``side`` is the direction in which it opens."""

    def across(
        near: float, far: float, low: tuple[float, float], high: tuple[float, float]
    ) -> Solid:
        x0, x1 = sorted((side * near, side * far))
        return box((x0, *low), (x1, *high))

    # The rack passes over the carriage of the other jaw, next to its rack.
    rack_end = rack_at + 0.012
    carriage = across(0.0, 0.02, (-0.039, -0.1), (0.026, -0.0716))
    # Head and rack reach into their neighbours, as the parts of the body do.
    head = across(0.0, 0.02, (rack_at, -0.0721), (rack_end, -0.0606))
    rack = across(-0.1509, 0.001, (rack_at, -0.0706), (rack_end, -0.0606))
    finger = (-0.1391, -0.1466), (-0.039, -0.0906)
    pad = _solid(RUBBER, across(0.0, 0.003, *finger))
    return Link(
        name,
        {
            "carriage": _printed(carriage, head, rack),
            "finger": (*_printed(across(0.003, 0.02, *finger)), *pad),
        },
    )


class Lengths(Protocol):
    """Lengths of an arm for drawing its bars; parameters and kinematics have them."""

    @property
    def upper_arm(self) -> float:
        """Distance from the column's axis to the elbow's [m]."""

    @property
    def forearm(self) -> float:
        """Distance from the elbow's axis to the wrist's [m]."""


def drawing(geometry: Lengths) -> tuple[Link, ...]:
    """Return the links that have a body, from the base to the jaws."""
    return (
        _base(),
        _column(),
        _upper_arm(geometry.upper_arm),
        _forearm(geometry.forearm),
        _wrist(),
        *hand(),
    )


def hand() -> tuple[Link, Link, Link]:
    """Return the gripper and its left and right jaw, each in a frame whose x the jaws move along.

    The jaws' faces are at x = 0 of their frames.
    """
    return (
        _gripper(),
        _jaw("left_jaw_link", 1.0, 0.014),
        _jaw("right_jaw_link", -1.0, -0.002),
    )
