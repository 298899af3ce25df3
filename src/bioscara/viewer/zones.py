"""Display of zones and table on the page."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import viser

from bioscara.planning.collision.scene import Scene, Zone
from bioscara.planning.collision.shapes import Prism

NEAREST = (255, 0, 0)
"""Colour of the nearest pair of bodies."""
Mark = Callable[[bool], None]
"""Marks a displayed body as one of the nearest pair, or removes the mark."""
_KEEP_OUT, _KEEP_IN, _TABLE = (214, 39, 40), (44, 160, 44), (150, 111, 71)
_OPACITY, _NEAREST_OPACITY = 0.35, 0.75
_LINE = 2.0
"""Width of edges [pixels]."""
_TABLE_SIZE, _TABLE_THICKNESS = 2.0, 0.02
"""Size of the displayed table [m]: its real extent is not specified."""
_TABLE_OFFSET = 1e-3
"""Offset of the displayed table below its height [m], so that the grid on the floor is visible."""
_POSTS = 8
"""Largest number of upright edges of a displayed round zone."""


def add_scene(server: viser.ViserServer, base: str, scene: Scene) -> dict[str, Mark]:
    """Show zones and table: keep-out red and translucent, keep-in as green edges.

    Args:
        server: Server of the page.
        base: Name of the frame of the arm's base.
        scene: Scene to show.

    Returns:
        A function for each zone, by its name, and for ``"table"``, that marks it. A keep-out zone
        is red in any case: it is marked by being less translucent.
    """
    marks: dict[str, Mark] = {}
    if scene.table_height is not None:
        table = server.scene.add_box(
            f"{base}/table",
            color=_TABLE,
            dimensions=(_TABLE_SIZE, _TABLE_SIZE, _TABLE_THICKNESS),
            position=(0.0, 0.0, scene.table_height - _TABLE_THICKNESS / 2.0 - _TABLE_OFFSET),
        )
        marks["table"] = color_mark(table, _TABLE)
    for number, zone in enumerate(scene.zones):
        marks[zone.name] = _add_zone(server, f"{base}/zone_{number}", zone)
    return marks


def color_mark(handle: viser.BoxHandle | viser.MeshHandle, color: tuple[int, int, int]) -> Mark:
    """Return a function that marks a body by its colour.

    Args:
        handle: The displayed body.
        color: Its colour without the mark.
    """

    def mark(nearest: bool) -> None:
        handle.color = NEAREST if nearest else color

    return mark


def _add_zone(server: viser.ViserServer, name: str, zone: Zone) -> Mark:
    color = _KEEP_IN if zone.keep_in else _KEEP_OUT
    corners, faces = solid(zone.shape)
    body = None
    if not zone.keep_in:
        body = server.scene.add_mesh_simple(
            f"{name}/solid", corners, faces, color=color, opacity=_OPACITY, side="double",
            cast_shadow=False,
        )  # fmt: skip
    lines = edges(zone.shape)

    def draw_edges(color: tuple[int, int, int]) -> None:
        # Adding replaces them: the browser takes other colours of existing lines wrongly.
        server.scene.add_line_segments(
            f"{name}/edges", lines, color, thickness=_LINE, thickness_units="screen"
        )

    draw_edges(color)
    label = zone.name + (f" ({', '.join(zone.links)})" if zone.links else "")
    server.scene.add_label(f"{name}/name", label, position=tuple(corners[-1].tolist()))

    def mark(nearest: bool) -> None:
        draw_edges(NEAREST if nearest else color)
        if body is not None:
            body.opacity = _NEAREST_OPACITY if nearest else _OPACITY

    return mark


def solid(shape: Prism) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.uint32]]:
    """Return the surface of a shape.

    Args:
        shape: Shape in the frame of the base.

    Returns:
        Corners [m], bottom first, shape (2 n, 3), and the numbers of each triangle's corners,
        counterclockwise from outside, shape (4 n - 4, 3).
    """
    around = shape.outline()
    count = len(around)
    bottom, top = (np.column_stack((around, np.full(count, z))) for z in (shape.low, shape.high))
    here = np.arange(count)
    after = (here + 1) % count
    fan = np.column_stack((np.zeros(count - 2, dtype=int), here[1:-1], here[2:]))
    triangles = np.concatenate(
        (
            np.column_stack((here, after, after + count)),
            np.column_stack((here, after + count, here + count)),
            fan[:, ::-1],
            fan + count,
        )
    )
    return np.concatenate((bottom, top)).astype(np.float32), triangles.astype(np.uint32)


def edges(shape: Prism) -> npt.NDArray[np.float32]:
    """Return the edges of a shape: both borders, and some posts between them.

    Args:
        shape: Shape in the frame of the base.

    Returns:
        Both ends of each edge [m], shape (n, 2, 3).
    """
    corners, _ = solid(shape)
    count = len(corners) // 2
    bottom, top = corners[:count], corners[count:]
    posts = slice(None, None, max(1, count // _POSTS))
    return np.concatenate(
        (
            np.stack((bottom, np.roll(bottom, -1, axis=0)), axis=1),
            np.stack((top, np.roll(top, -1, axis=0)), axis=1),
            np.stack((bottom[posts], top[posts]), axis=1),
        )
    )
