"""Images of a simulated world that a command takes again and again."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Self

from bioscara.errors import InvalidArgumentError
from bioscara.files.whole_files import replacing
from bioscara.physics.camera import CameraView, png
from bioscara.physics.stills import Still, image_of, still_of
from bioscara.physics.world import PhysicsWorld

_PERIOD = 1.0
"""Time from one image to the next [s]."""
_NICE = 10
"""Amount by which drawing gives way to the simulated arm."""


class Pictures:
    """While entered, writes an image of a world about once a second, in a thread of its own.

    Args:
        world: The world.
        view: Camera and size.
        path: The file, which is replaced as a whole.
        report: Gets a sentence when an image cannot be written.
    """

    def __init__(
        self, world: PhysicsWorld, view: CameraView, path: Path, report: Callable[[str], object]
    ) -> None:
        self._world, self._view, self._path, self._report = world, view, path, report
        self._still: Still
        self._wanted, self._taken, self._end = (threading.Event() for _ in range(3))
        self._begun = threading.Event()
        self._failed: Exception | None = None
        self._thread = threading.Thread(target=self._run, name="bioscara-image", daemon=True)

    def __enter__(self) -> Self:
        """Write the first image.

        Raises:
            NotSupportedError: Nothing can be drawn here.
            InvalidArgumentError: The file cannot be written.
        """
        self._wanted.set()
        self.step()
        self._thread.start()
        self._begun.wait()
        if isinstance(self._failed, OSError):
            raise InvalidArgumentError(_unwritable(self._path, self._failed)) from self._failed
        if self._failed is not None:
            raise self._failed
        return self

    def __exit__(self, *_: object) -> None:
        self._end.set()
        self._taken.set()
        # It draws an image to its end: OpenGL must not be in use when the process ends.
        self._thread.join()

    def step(self) -> None:
        """Copy the positions for the next image if it is due; in the thread of the arm's time."""
        if self._wanted.is_set():
            self._wanted.clear()
            self._still = still_of(self._world)
            self._taken.set()

    def _run(self) -> None:
        # Lowers the priority of this thread; threads that OpenGL starts inherit it.
        with suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICE)
        complained = False
        while not self._end.is_set():
            self._taken.wait()
            self._taken.clear()
            if self._end.is_set():
                break
            try:
                self._write()
                complained = False
            except Exception as error:  # noqa: BLE001  the arm goes on
                self._failed = error
                if not self._begun.is_set():
                    break
                if not complained:
                    self._report(f"warning: {_unwritable(self._path, error)}")
                complained = True
            self._begun.set()
            self._end.wait(_PERIOD)
            self._wanted.set()
        self._begun.set()

    def _write(self) -> None:
        data = png(image_of(self._still, *self._view))
        with replacing(self._path) as partial:
            partial.write_bytes(data)


def _unwritable(path: Path, error: Exception) -> str:
    why = error.strerror if isinstance(error, OSError) else str(error)
    return f"the image {path} cannot be written: {why}; make its folder and room, or give another"
