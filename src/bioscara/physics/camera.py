"""Images of a MuJoCo model without a screen or graphics processor; extra ``physics-view``."""

from __future__ import annotations

import atexit
import ctypes
import math
import os
import struct
import threading
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from bioscara.errors import InvalidArgumentError, NotSupportedError
from bioscara.extras import install
from bioscara.physics.engine import mujoco
from bioscara.spelling import did_you_mean

Triple = tuple[float, float, float]
Image = npt.NDArray[np.uint8]
"""Rows from the top of red, green and blue, shape (height, width, 3)."""

SIZE = (640, 480)
"""Width and height of an image where none are given [pixels]."""
SIZES = (16, 2048)
"""Smallest and largest width and height of an image [pixels]."""
_VIEWS = (math.radians(1.0), math.radians(150.0))
"""Smallest and largest field of view [rad]."""
_FARTHEST = 100.0
"""Largest coordinate of a camera [m]."""
_NEAR, _FAR = 0.01, 50.0
"""Distances between which bodies are drawn [m]."""
_AMBIENT, _DIFFUSE = 0.42, 0.3
"""Brightness of the light at the camera: from all sides, and on what faces it."""
_GEOMS = 20_000
"""Shapes that an image can have."""
_IDAT = 41
"""Where the data of the pixels begin in a PNG file of ours."""
_KEPT = 4
"""Sizes of which a thread keeps the renderer."""


@dataclass(frozen=True, slots=True)
class Camera:
    """Where images are taken from; the image's upper edge is towards z, or y if it looks along z.

    Attributes:
        position: Place of the camera [m].
        target: Point in the middle of its images [m].
        field_of_view: Angle between the lower and the upper edge of its images [rad].
        body: Body of the model in whose frame position and target are, with which the camera
            moves; empty for the base frame of the arm.

    Raises:
        InvalidArgumentError: A number is not finite or outside its limits, or both points are one.
    """

    position: Triple
    target: Triple
    field_of_view: float = math.radians(45.0)
    body: str = ""

    def __post_init__(self) -> None:
        for name in ("position", "target"):
            value = getattr(self, name)
            if len(value) != 3 or not all(abs(part) <= _FARTHEST for part in value):
                raise InvalidArgumentError(
                    f"camera: {name} {value} must be x, y, z within +-{_FARTHEST:g} m"
                )
        if math.dist(self.position, self.target) < _NEAR:
            raise InvalidArgumentError(
                f"camera: position {self.position} and target {self.target} must be {_NEAR:g} m "
                "apart or more, for a direction"
            )
        lowest, highest = _VIEWS
        if not lowest <= self.field_of_view <= highest:
            raise InvalidArgumentError(
                f"camera: field_of_view {self.field_of_view} is outside {lowest:.3f} .. "
                f"{highest:.3f} rad"
            )


CAMERAS: Mapping[str, Camera] = MappingProxyType(
    {
        "front": Camera((1.7, 0.0, 0.75), (0.2, 0.0, 0.22)),
        "side": Camera((0.3, -1.6, 0.6), (0.3, 0.0, 0.22)),
        "top": Camera((0.25, 0.0, 2.0), (0.25, 0.0, 0.0)),
        "wrist": Camera((0.045, 0.0, 0.05), (0.12, 0.0, -0.17), math.radians(70.0), "link_4"),
    }
)
"""Cameras by name: three that stand, and one on the gripper, above the jaws."""


class CameraView(NamedTuple):
    """Camera and size of an image.

    Attributes:
        camera: Name of the camera, of :data:`CAMERAS`.
        size: Width and height [pixels].
    """

    camera: str
    size: tuple[int, int] = SIZE


def camera_of(place: str | Camera) -> Camera:
    """Return a camera, or the one of :data:`CAMERAS` with this name.

    Raises:
        InvalidArgumentError: None has it.
    """
    if isinstance(place, Camera):
        return place
    if place not in CAMERAS:
        names = f"there are {', '.join(CAMERAS)}"
        raise InvalidArgumentError(
            f"there is no camera {place!r}; {did_you_mean(place, CAMERAS, names)}"
        )
    return CAMERAS[place]


def pixels(data: bytes) -> Image:
    """Return the image in a file of :func:`png`.

    Raises:
        InvalidArgumentError: The file is none of these.
    """
    try:
        width, height = struct.unpack_from(">II", data, 16)
        length = int.from_bytes(data[_IDAT - 8 : _IDAT - 4], "big")
        rows = np.frombuffer(zlib.decompress(data[_IDAT : _IDAT + length]), dtype=np.uint8)
        return rows.reshape(height, 1 + 3 * width)[:, 1:].reshape(height, width, 3)
    except (struct.error, zlib.error, ValueError) as error:
        raise InvalidArgumentError(f"this is no image of a simulated world: {error}") from error


def checked_size(size: tuple[int, int]) -> tuple[int, int]:
    """Return width and height of an image [pixels].

    Raises:
        InvalidArgumentError: They are outside :data:`SIZES`.
    """
    least, most = SIZES
    whole = len(size) == 2 and all(isinstance(part, int | np.integer) for part in size)
    if not whole or not all(least <= part <= most for part in size):
        raise InvalidArgumentError(
            f"image size {size} must be width and height in pixels, {least} .. {most} each"
        )
    return int(size[0]), int(size[1])


def render(
    model: Any,
    data: Any,
    camera: str | Camera = "front",
    size: tuple[int, int] = SIZE,
) -> Image:
    """Return the image that a camera takes, without shadows, of the shapes in groups 0 to 2.

    A light is at the camera, so that the model needs none. The first image of a thread and size
    takes longer: its renderer is made, and kept as long as the model stays the same object. It
    belongs to the thread, as OpenGL requires. Model and data do not change, and no other thread may
    step them during the call.

    Args:
        model: The model, a ``mujoco.MjModel``.
        data: Its state, a ``mujoco.MjData``, of which the positions of bodies are computed.
        camera: The camera, or the name of one of :data:`CAMERAS`.
        size: Width and height [pixels].

    Returns:
        Red, green and blue of each pixel, rows from the top, shape (height, width, 3).

    Raises:
        InvalidArgumentError: The size is outside :data:`SIZES`, the camera is unknown, or the model
            has no such body.
        NotSupportedError: The extra ``physics-view`` is missing, or a library of the system that
            draws without a screen.
    """
    view, (width, height) = camera_of(camera), checked_size(size)
    if not hasattr(_of_thread, "stages"):
        _of_thread.stages = {}
    stages: dict[tuple[int, int], _Stage] = _of_thread.stages
    stage = stages.pop((width, height), None)
    if stage is None or stage.model is not model:
        if len(stages) == _KEPT:
            del stages[next(iter(stages))]
        stage = _Stage(model, width, height)
    stages[width, height] = stage
    return stage.draw(data, *_placed(view, data), view.field_of_view)


def png(image: Image) -> bytes:
    """Return an image as a PNG file.

    Raises:
        InvalidArgumentError: It is not an array of bytes of shape (height, width, 3).
    """
    if image.dtype != np.uint8 or image.ndim != 3 or image.shape[2] != 3 or not image.size:
        raise InvalidArgumentError(
            f"image: {image.dtype} of shape {image.shape} must be uint8 of (height, width, 3)"
        )
    height, width, _ = image.shape
    # Each row begins with its filter, 0: none.
    rows = np.pad(image.reshape(height, -1), ((0, 0), (1, 0)))
    chunks = (
        (b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)),
        (b"IDAT", zlib.compress(rows.tobytes(), 1)),
        (b"IEND", b""),
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in chunks
    )


def _placed(
    camera: Camera, data: Any
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return place, direction and upwards direction of a camera in the frame of the model."""
    origin, axes = np.zeros(3), np.eye(3)
    if camera.body:
        try:
            body = data.body(camera.body)
        except KeyError:
            raise InvalidArgumentError(
                f"camera: the model has no body {camera.body!r}: name another camera"
            ) from None
        origin, axes = body.xpos, body.xmat.reshape(3, 3)
    position = np.asarray(camera.position, dtype=np.float64)
    forward = np.asarray(camera.target) - position
    forward /= np.linalg.norm(forward)
    upright = abs(forward[2]) < 1.0 - 1e-6
    up = np.array((0.0, 0.0, 1.0) if upright else (0.0, 1.0, 0.0))
    up -= (up @ forward) * forward
    return origin + axes @ position, axes @ forward, axes @ (up / np.linalg.norm(up))


_of_thread = threading.local()


class _Stage:
    """Draws a model at one size, in the thread that made it.

    Args:
        model: The model, a ``mujoco.MjModel``.
        width: Width of the images [pixels].
        height: Their height [pixels].

    Raises:
        NotSupportedError: As :func:`render`.
    """

    def __init__(self, model: Any, width: int, height: int) -> None:
        self._context = _context(width, height)
        # To be called before the end of EGL, which the first context has registered.
        atexit.unregister(_end)
        atexit.register(_end)
        self._engine = engine = mujoco("an image")
        self.model = model
        self._context.make_current()
        self._drawing = engine.MjrContext(model, engine.mjtFontScale.mjFONTSCALE_100.value)
        engine.mjr_resizeOffscreen(width, height, self._drawing)
        engine.mjr_setBuffer(engine.mjtFramebuffer.mjFB_OFFSCREEN.value, self._drawing)
        self._scene = engine.MjvScene(model, _GEOMS)
        for costly in (engine.mjtRndFlag.mjRND_SHADOW, engine.mjtRndFlag.mjRND_REFLECTION):
            self._scene.flags[costly] = 0
        self._rectangle = engine.MjrRect(0, 0, width, height)
        self._image = np.empty((height, width, 3), dtype=np.uint8)

    def draw(
        self,
        data: Any,
        position: npt.NDArray[np.float64],
        forward: npt.NDArray[np.float64],
        up: npt.NDArray[np.float64],
        field_of_view: float,
    ) -> Image:
        """Return an image of the bodies where the state has them."""
        engine = self._engine
        self._context.make_current()
        engine.mjv_updateScene(
            self.model,
            data,
            engine.MjvOption(),
            None,
            engine.MjvCamera(),
            engine.mjtCatBit.mjCAT_ALL.value,
            self._scene,
        )
        top = _NEAR * math.tan(0.5 * field_of_view)
        for eye in self._scene.camera:
            eye.pos, eye.forward, eye.up = position, forward, up
            eye.frustum_bottom, eye.frustum_top = -top, top
            eye.frustum_near, eye.frustum_far = _NEAR, _FAR
            eye.frustum_center = eye.frustum_width = 0.0
        for light in self._scene.lights[: self._scene.nlight]:
            if light.headlight:
                light.pos, light.dir = position, forward
                light.ambient, light.diffuse = [_AMBIENT] * 3, [_DIFFUSE] * 3
                light.specular = [0.0] * 3
        engine.mjr_render(self._rectangle, self._scene, self._drawing)
        engine.mjr_readPixels(self._image, None, self._rectangle, self._drawing)
        return self._image[::-1].copy()

    def __del__(self) -> None:
        # MuJoCo frees its buffers in the context that is current then.
        if hasattr(self, "_drawing") and not _ended:
            self._context.make_current()
            self._drawing.free()
            self._context.free()


_ended = False


def _end() -> None:
    """Free the renderers of the main thread; those of others end with the process."""
    global _ended  # noqa: PLW0603
    _of_thread.__dict__.clear()
    _ended = True


def _context(width: int, height: int) -> Any:
    """Return a new context of OpenGL that draws without a screen.

    $MUJOCO_GL chooses it, egl or osmesa; otherwise it is EGL where that has a device. MuJoCo's own
    choice, at its import, is not used: without $MUJOCO_GL that would be a window.
    """
    chosen = os.environ.get("MUJOCO_GL", "")
    if chosen not in {"egl", "osmesa"}:
        chosen = "egl" if _has_egl() else "osmesa"
    try:
        return import_module(f"mujoco.{chosen}").GLContext(width, height)
    except ModuleNotFoundError as error:
        raise NotSupportedError(
            f"images need {error.name}, which is not installed: {install('physics-view')}"
        ) from error
    # PyOpenGL fails in many ways where the library of the system is missing.
    except Exception as error:
        raise NotSupportedError(
            f"images need OpenGL without a screen, and {chosen} failed ({error}): on Debian and "
            "Ubuntu, apt install libegl1 libgl1-mesa-dri, or libosmesa6 and MUJOCO_GL=osmesa"
        ) from error


def _has_egl() -> bool:
    """Return whether EGL has a device; asked apart from PyOpenGL, which can be loaded only once."""
    try:
        library = ctypes.CDLL("libEGL.so.1")
        library.eglGetProcAddress.restype = ctypes.c_void_p
        address = library.eglGetProcAddress(b"eglQueryDevicesEXT")
    except (OSError, AttributeError):
        return False
    if not address:
        return False
    found = ctypes.c_int()
    query = ctypes.CFUNCTYPE(
        ctypes.c_uint, ctypes.c_int, ctypes.c_void_p, ctypes.POINTER(ctypes.c_int)
    )(address)
    return bool(query(0, None, ctypes.byref(found))) and found.value > 0
