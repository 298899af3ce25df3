"""Images of a world that goes on: each is of one time, and no step waits for it."""

from __future__ import annotations

import copy
import threading
from typing import Any, NamedTuple

from bioscara.physics.camera import Camera, Image, render
from bioscara.physics.coupling import allow_sleep
from bioscara.physics.engine import mujoco
from bioscara.physics.world import PhysicsWorld
from bioscara.planning.arrays import Array


class Still(NamedTuple):
    """A world at one time, for a thread or process that draws it later; it can be pickled.

    Attributes:
        model: The engine's model, of which bodies and shapes are used.
        positions: Of its joints, which bodies that move freely are too; shape (nq,).
        rotations: Of its bodies in their parents, which a tilt changes; shape (nbody, 4).
    """

    model: Any
    positions: Array
    rotations: Array


def still_of(world: PhysicsWorld) -> Still:
    """Return a world as it is now, in microseconds; in the thread in which its time passes."""
    return Still(world.model, world.data.qpos.copy(), world.model.body_quat.copy())


def image_of(still: Still, camera: str | Camera, size: tuple[int, int]) -> Image:
    """Return the image that a camera takes of a world, in any thread.

    Args:
        still: The world.
        camera: The camera, or the name of one of :data:`bioscara.physics.camera.CAMERAS`.
        size: Width and height [pixels].

    Returns:
        Red, green and blue of each pixel, rows from the top, shape (height, width, 3).

    Raises:
        InvalidArgumentError: As :func:`bioscara.physics.camera.render`.
        NotSupportedError: As there.
    """
    engine = mujoco("an image")
    if getattr(_of_thread, "source", None) is not still.model:
        # A copy: the model of the running world changes while a body is tilted.
        _of_thread.model = copy.copy(still.model)
        # Bodies that sleep would not be placed.
        allow_sleep(_of_thread.model.opt, allowed=False)
        _of_thread.data = engine.MjData(_of_thread.model)
        _of_thread.source = still.model
    model, data = _of_thread.model, _of_thread.data
    model.body_quat[:], data.qpos[:] = still.rotations, still.positions
    engine.mj_kinematics(model, data)
    engine.mj_camlight(model, data)
    return render(model, data, camera, size)


_of_thread = threading.local()
