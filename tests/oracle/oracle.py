"""Which links of the arm intersect at a pose: pinocchio places them, coal intersects them.

Nothing of ``bioscara`` decides here: the joints and their frames are read from the URDF by
pinocchio, the bodies are those of the visual meshes, and a pair of them intersects where coal finds
their convex solids inside each other. Joints are j1 to j4 [rad, m, rad, rad] and the width between
the jaws [m].
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from itertools import combinations
from typing import NamedTuple

import coal
import numpy as np
import numpy.typing as npt
import pinocchio as pin

from bioscara.model.stl import read_stl
from bioscara.model.urdf import URDF, mesh_file
from oracle.solids import Array, Solid, solid, split

LINKS = (
    "base_link", "link_1", "link_2", "link_3", "link_4",
    "grp_base_link", "left_jaw_link", "right_jaw_link",
)  # fmt: skip
HAND = LINKS[5:]
JAWS = LINKS[6:]
JOINED = frozenset(
    frozenset(pair)
    for pair in (
        ("base_link", "link_1"), ("link_1", "link_2"), ("link_2", "link_3"), ("link_3", "link_4"),
        ("link_4", "grp_base_link"), ("grp_base_link", "left_jaw_link"),
        ("grp_base_link", "right_jaw_link"),
    )
)  # fmt: skip
"""Links with a joint between them, whose solids slide in each other by design."""
_CHUNK = 4000
"""Poses that are evaluated together."""
_TOUCH = 1e-6
"""Solids no deeper inside each other than this touch [m]; the meshes are rounded to it."""


class Hit(NamedTuple):
    """Two links that are nearer to each other than the given distance.

    Attributes:
        row: Number of the pose.
        links: Their names.
        distance: Between them [m]; below zero, how deep one is in the other.
    """

    row: int
    links: tuple[str, str]
    distance: float


@cache
def solids() -> tuple[Solid, ...]:
    """Return the convex solids of all visual meshes of the description."""
    found = []
    for link in ET.parse(URDF).getroot().findall("link"):
        for mesh in link.findall("visual/geometry/mesh"):
            triangles = read_stl(mesh_file(mesh.attrib["filename"]).read_bytes())
            found += [solid(link.attrib["name"], part) for part in split(triangles)]
    return tuple(found)


def load(corners: npt.ArrayLike) -> Solid:
    """Return a convex load that the wrist carries.

    Args:
        corners: In the frame of the wrist [m], shape (n, 3).
    """
    return solid("load", np.asarray(corners, dtype=np.float64))


class Oracle:
    """Finds links that intersect.

    Args:
        carried: The load of the wrist, from :func:`load`; it may touch the hand that holds it.
        pairs: Pairs of links to check; all that have no joint between them by default.
    """

    def __init__(
        self,
        carried: Sequence[Solid] = (),
        pairs: Iterable[tuple[str, str]] | None = None,
    ) -> None:
        self._model = pin.buildModelFromUrdf(str(URDF))
        self._data = self._model.createData()
        places = {name: self._model.getFrameId(name) for name in LINKS}
        self._bodies = {
            name: _Body([each for each in (*solids(), *carried) if each.link == name])
            for name in (*LINKS, *(["load"] if carried else []))
        }
        self._frames = [places["link_4" if name == "load" else name] for name in self._bodies]
        self._pairs = [
            (one, other)
            for one, other in (combinations(self._bodies, 2) if pairs is None else pairs)
            if frozenset((one, other)) not in JOINED
            and not (other == "load" and one in ("link_4", *HAND))
        ]
        named = ("j1", "j2", "j3", "j4", "gripper", "gripper_l_mimic", "gripper_r_mimic")
        self._columns = np.empty(self._model.nq, dtype=np.intp)
        for column, name in enumerate(named):
            self._columns[self._model.joints[self._model.getJointId(name)].idx_q] = column

    @property
    def pairs(self) -> list[tuple[str, str]]:
        """The pairs of links that are checked."""
        return list(self._pairs)

    def hits(
        self, joints: npt.ArrayLike, widths: npt.ArrayLike, within: float = 0.0
    ) -> Iterator[Hit]:
        """Yield the pairs of links that intersect, by pose.

        Args:
            joints: j1 to j4 [rad, m, rad, rad], shape (n, 4).
            widths: Between the jaws [m], shape (n,) or a number for all.
            within: Yield also pairs that are apart, but by less than this [m].
        """
        rows = np.asarray(joints, dtype=np.float64).reshape(-1, 4)
        wide = np.broadcast_to(np.asarray(widths, dtype=np.float64), len(rows))
        if not (np.isfinite(rows).all() and np.isfinite(wide).all()):
            raise ValueError("a joint or a width is not a finite number")
        for begin in range(0, len(rows), _CHUNK):
            part = slice(begin, begin + _CHUNK)
            yield from self._look(rows[part], wide[part], within, begin)

    def colliding(self, joints: npt.ArrayLike, widths: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Return whether links intersect at each pose, shape (n,)."""
        found = np.zeros(len(np.asarray(joints).reshape(-1, 4)), dtype=np.bool_)
        for hit in self.hits(joints, widths):
            found[hit.row] = True
        return found

    def clearances(self, joints: npt.ArrayLike, widths: npt.ArrayLike, within: float) -> Array:
        """Return the distance between the nearest links at each pose, at most ``within`` [m]."""
        found = np.full(len(np.asarray(joints).reshape(-1, 4)), within)
        for hit in self.hits(joints, widths, within):
            found[hit.row] = min(found[hit.row], hit.distance)
        return found

    def _look(self, joints: Array, widths: Array, within: float, first: int) -> Iterator[Hit]:
        turns, places = self._placements(joints, widths)
        request, result = coal.DistanceRequest(), coal.DistanceResult()
        names = list(self._bodies)
        limit = within if within > 0.0 else -_TOUCH
        for one, other in self._pairs:
            a, b = names.index(one), names.index(other)
            body_a, body_b = self._bodies[one], self._bodies[other]
            # The other link in the frame of the first.
            back = turns[:, a].transpose(0, 2, 1)
            turn = back @ turns[:, b]
            place = np.einsum("nij,nj->ni", back, places[:, b] - places[:, a])
            near = np.flatnonzero(_near(body_a.whole, body_b.whole, turn, place, within)[:, 0, 0])
            mask = _near(body_a, body_b, turn[near], place[near], within)
            nearest: dict[int, float] = {}
            for row, i, k in zip(*(index.tolist() for index in np.nonzero(mask)), strict=True):
                at = int(near[row])
                result.clear()
                distance = coal.distance(
                    body_a.solids[i].shape,
                    _IDENTITY,
                    body_b.solids[k].shape,
                    coal.Transform3s(turn[at], place[at]),
                    request,
                    result,
                )
                if distance < limit:
                    nearest[at] = min(nearest.get(at, np.inf), distance)
            for at, distance in nearest.items():
                yield Hit(first + at, (one, other), distance)

    def _placements(self, joints: Array, widths: Array) -> tuple[Array, Array]:
        """Return the orientation (n, links, 3, 3) and the position (n, links, 3) of each link."""
        values = np.column_stack((joints, widths, 0.5 * widths, -0.5 * widths))[:, self._columns]
        turns = np.empty((len(values), len(self._frames), 3, 3))
        places = np.empty((len(values), len(self._frames), 3))
        for row, value in enumerate(values):
            pin.framesForwardKinematics(self._model, self._data, value)
            for number, frame in enumerate(self._frames):
                placed = self._data.oMf[frame]
                turns[row, number], places[row, number] = placed.rotation, placed.translation
        return turns, places


_IDENTITY = coal.Transform3s.Identity()


class _Body:
    """The solids of one link, with the boxes around them in its frame."""

    def __init__(self, parts: Sequence[Solid]) -> None:
        self.solids = tuple(parts)
        lower = np.array([part.corners.min(axis=0) for part in parts])
        upper = np.array([part.corners.max(axis=0) for part in parts])
        self.centres, self.halves = (lower + upper) / 2.0, (upper - lower) / 2.0
        self.whole = self
        if len(parts) > 1:
            corners = np.concatenate([part.corners for part in parts])
            self.whole = _Body([Solid("", corners, None)])


def _near(a: _Body, b: _Body, turn: Array, place: Array, within: float) -> npt.NDArray[np.bool_]:
    """Return whether boxes around solids may be nearer than ``within``, shape (n, a, b).

    Separated along the axes of either box: no solid of an excluded pair is so near.
    """
    centre = np.einsum("nij,bj->nbi", turn, b.centres) + place[:, None]
    apart = centre[:, None] - a.centres[:, None]
    size = np.abs(turn)
    reach = a.halves[:, None] + np.einsum("nij,bj->nbi", size, b.halves)[:, None] + within
    near = (np.abs(apart) <= reach).all(axis=-1)
    along = np.einsum("nji,nabj->nabi", turn, apart)
    reach = b.halves + np.einsum("nji,aj->nai", size, a.halves)[:, :, None] + within
    met: npt.NDArray[np.bool_] = near & (np.abs(along) <= reach).all(axis=-1)
    return met
