"""Which parts of an arm may meet each other, whatever its joints do."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from bioscara.kinematics import Geometry
from bioscara.planning.collision.arm_bodies import (
    ATTACHED,
    BASE,
    COLUMN,
    FOREARM,
    UPPER_ARM,
    WRIST,
    Body,
    extent,
)
from bioscara.planning.collision.shape_arrays import Table
from bioscara.planning.collision.shapes import Index, Prism, distances

OWN_MARGIN = 5e-3
"""What the arm's own parts keep from each other where the margin of the scene is larger [m]: they
are known, and folded up as homing leaves the arm they are 15 mm apart."""
_BEYOND_END = 5e-3
"""How far the lift may be beyond its limits [m]: pressed on by hand."""
_TURNS = 201
"""At so many angles of the elbow its range is looked at."""
_ROUNDING = 1e-9
Range = tuple[float, float]
"""Lowest and highest."""
Meeting = tuple[int, int, tuple[Index, Index]]
"""Numbers of two bodies, and of the parts of each that may meet, pair by pair."""


def meetings(
    arm: tuple[Body, ...], links: int, geometry: Geometry, ranges: tuple[Range, Range]
) -> list[Meeting]:
    """Return which bodies of an arm may meet, by their numbers, and which parts of them.

    Args:
        arm: All of its bodies; the last is the tool's point, which nothing is kept from.
        links: So many of them are links; the rest is carried by the wrist.
        geometry: Of the arm.
        ranges: Of lift and elbow.
    """
    found = list(_links_meeting(arm[:links], geometry, ranges))
    for k in range(links, len(arm) - 1):
        for i in range(k):
            parts = _meeting(arm[i], arm[k], geometry.height, ranges[0])
            if parts is not None:
                found.append((i, k, parts))
    return found


@lru_cache(maxsize=4)
def _links_meeting(
    links: tuple[Body, ...], geometry: Geometry, ranges: tuple[Range, Range]
) -> tuple[Meeting, ...]:
    """Return which links may meet; those of the existing arm do not, within its elbow's range."""
    found = []
    for k, other in enumerate(links):
        for i, one in enumerate(links[:k]):
            parts = _meeting(one, other, geometry.height, ranges[0])
            if parts is not None and _near(one, other, parts, geometry, ranges[1]):
                found.append((i, k, parts))
    return tuple(found)


def _meeting(one: Body, other: Body, height: float, lift: Range) -> tuple[Index, Index] | None:
    """Return which parts of two bodies of the arm may meet, if any; by their heights.

    What turns together, or is in one another by construction, does not meet.
    """
    if one.frame == other.frame or {one.link, other.link} in ATTACHED:
        return None
    lifted = [body.frame >= UPPER_ARM for body in (one, other)]
    ranges = []
    for body, up in zip((one, other), lifted, strict=True):
        stands = 0.0 if body.frame == BASE else height
        down, raised = lift if up and not all(lifted) else (0.0, 0.0)
        beyond = 0.0 if all(lifted) or not any(lifted) else _BEYOND_END
        ranges.append(
            (
                np.array([shape.low for shape in body.shapes]) + (stands + down - beyond),
                np.array([shape.high for shape in body.shapes]) + (stands + raised + beyond),
            )
        )
    (low_one, high_one), (low_other, high_other) = ranges
    first, second = np.nonzero(
        (low_one[:, None] < high_other - _ROUNDING) & (low_other < high_one[:, None] - _ROUNDING)
    )
    return (first, second) if len(first) else None


def _near(
    one: Body, other: Body, parts: tuple[Index, Index], geometry: Geometry, elbow: Range
) -> bool:
    """Return whether a link before the elbow and one after it come near to each other.

    Looked at from above, and as if the wrist turned all the way round.
    """
    if one.frame not in (COLUMN, UPPER_ARM) or other.frame not in (FOREARM, WRIST):
        return True
    turns = np.linspace(*elbow, _TURNS)
    x, y = geometry.upper_arm, 0.0
    if other.frame == WRIST:
        shapes = [Prism(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, extent(other))]
        parts = parts[0], 0 * parts[1]
    else:
        shapes = [replace(shape, low=0.0, high=0.0) for shape in other.shapes]
    before = [replace(shape, low=0.0, high=0.0) for shape in one.shapes]
    zero = np.zeros(len(turns))
    cos, sin = np.cos(turns), np.sin(turns)
    ahead = geometry.forearm if other.frame == WRIST else 0.0
    here, there = Table.of([0] * len(before), before), Table.of([0] * len(shapes), shapes)
    still = (zero[None], zero[None], zero[None], zero[None] + 1.0, zero[None])
    turned = (x + ahead * cos[None], y + ahead * sin[None], zero[None], cos[None], sin[None])
    gaps = distances(here.everywhere(still).take(parts[0]), there.everywhere(turned).take(parts[1]))
    missed = (geometry.forearm + extent(other)) * (elbow[1] - elbow[0]) / (2.0 * (_TURNS - 1))
    return float(gaps.min()) - missed < OWN_MARGIN
