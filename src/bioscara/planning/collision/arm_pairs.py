"""Pairs of the arm's own parts that can collide at some joint positions."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from bioscara.kinematics import Geometry
from bioscara.planning.arrays import Index
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
from bioscara.planning.collision.margins import OWN_MARGIN
from bioscara.planning.collision.shapes import Prism, ShapeTable, distances

_BEYOND_END = 5e-3
"""How far the lift may be beyond its limits when pushed by hand [m]."""
_TURNS = 201
"""Number of elbow angles at which its range is sampled."""
_ROUNDING = 1e-9
Span = tuple[float, float]
"""Lowest and highest value."""
PartPairs = tuple[int, int, tuple[Index, Index]]
"""Indices of two bodies, and of the parts of each that can collide, pair by pair."""


def colliding_pairs(
    arm: tuple[Body, ...], links: int, geometry: Geometry, ranges: tuple[Span, Span]
) -> list[PartPairs]:
    """Return the bodies of an arm that can collide, and their parts, by their indices.

    Args:
        arm: All of its bodies; the last is the tool's point, which is not checked here.
        links: How many of them are links; the rest is carried by the wrist.
        geometry: Of the arm.
        ranges: Of lift and elbow.
    """
    found = list(_colliding_links(arm[:links], geometry, ranges))
    for k in range(links, len(arm) - 1):
        for i in range(k):
            parts = _overlapping_parts(arm[i], arm[k], geometry.height, ranges[0])
            if parts is not None:
                found.append((i, k, parts))
    return found


@lru_cache(maxsize=4)
def _colliding_links(
    links: tuple[Body, ...], geometry: Geometry, ranges: tuple[Span, Span]
) -> tuple[PartPairs, ...]:
    """Return the links that can collide; on the existing arm none can, within its elbow's range."""
    found = []
    for k, other in enumerate(links):
        for i, one in enumerate(links[:k]):
            parts = _overlapping_parts(one, other, geometry.height, ranges[0])
            if parts is not None and _near_in_plan(one, other, parts, geometry, ranges[1]):
                found.append((i, k, parts))
    return tuple(found)


def _overlapping_parts(
    one: Body, other: Body, height: float, lift: Span
) -> tuple[Index, Index] | None:
    """Return the parts of two bodies of the arm that can collide by their heights, if any.

    Bodies of one frame, or of links that overlap by construction, are not paired.
    """
    if one.frame == other.frame or {one.link, other.link} in ATTACHED:
        return None
    lifted = [body.frame >= UPPER_ARM for body in (one, other)]
    ranges = []
    for body, up in zip((one, other), lifted, strict=True):
        base = 0.0 if body.frame == BASE else height
        down, raised = lift if up and not all(lifted) else (0.0, 0.0)
        beyond = 0.0 if all(lifted) or not any(lifted) else _BEYOND_END
        ranges.append(
            (
                np.array([shape.low for shape in body.shapes]) + (base + down - beyond),
                np.array([shape.high for shape in body.shapes]) + (base + raised + beyond),
            )
        )
    (low_one, high_one), (low_other, high_other) = ranges
    first, second = np.nonzero(
        (low_one[:, None] < high_other - _ROUNDING) & (low_other < high_one[:, None] - _ROUNDING)
    )
    return (first, second) if len(first) else None


def _near_in_plan(
    one: Body, other: Body, parts: tuple[Index, Index], geometry: Geometry, elbow: Span
) -> bool:
    """Return whether a link before the elbow and one after it can come within the margin.

    Evaluated in plan view, with the wrist as its full circle of rotation.
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
    here, there = ShapeTable.of([0] * len(before), before), ShapeTable.of([0] * len(shapes), shapes)
    still = (zero[None], zero[None], zero[None], zero[None] + 1.0, zero[None])
    turned = (x + ahead * cos[None], y + ahead * sin[None], zero[None], cos[None], sin[None])
    gaps = distances(here.everywhere(still).take(parts[0]), there.everywhere(turned).take(parts[1]))
    missed = (geometry.forearm + extent(other)) * (elbow[1] - elbow[0]) / (2.0 * (_TURNS - 1))
    return float(gaps.min()) - missed < OWN_MARGIN
