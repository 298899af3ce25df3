"""The state of the bench, which an owner cannot measure, kept for the next owner of the arm."""

from __future__ import annotations

import logging
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Literal

import msgspec

from bioscara.api.messages import SceneValue
from bioscara.api.values import scene_of, scene_value
from bioscara.errors import BioscaraError, ConfigurationError
from bioscara.files.whole_files import replacing
from bioscara.planning.collision.scene import Scene
from bioscara.robot.arm import Arm
from bioscara.robot.workspace.load import Load
from bioscara.robot.workspace.workspace import Workspace, WorkspacePart

_log = logging.getLogger(__name__)


class _Bench(msgspec.Struct, frozen=True):
    """Content of the file.

    Attributes:
        version: Version of the format.
        scene: The scene.
        tool: Name of the mounted tool.
        load: The carried load, or None.
        held: Width of the object between the jaws [m]; None if they hold none.
    """

    version: Literal[1]
    scene: SceneValue
    tool: str
    load: Load | None
    held: float | None


class BenchFile:
    """Scene, mounted tool, load and the width between the jaws, written whenever they change.

    Args:
        path: The file; None if nothing is kept.
    """

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self._kept: tuple[object, ...] = ()
        # A disk may be slow, and neither the loop nor the requests may wait for it.
        self._writer = ThreadPoolExecutor(1, "bioscara-bench")

    def restore(self, arm: Arm, declared: Scene | None) -> None:
        """Give the arm the state of the last owner; values that no file declares are not confirmed.

        Args:
            arm: The arm, with its table.
            declared: The scene of a file; None for that of the last owner.

        Raises:
            ConfigurationError: The file cannot be read, or its content cannot be used.
        """
        space = arm.workspace
        usual = space.scene
        if declared is not None:
            space = space.with_scene(replace(declared, widths=usual.widths))
        bench = self._read()
        if bench is not None:
            try:
                space, unconfirmed = _with_bench(space, bench, restored=declared is None)
            except BioscaraError as error:
                raise self._unusable(str(error)) from error
            space = replace(space, unconfirmed=unconfirmed)
            arm.jaws.held = bench.held
        arm.use_workspace(space)
        self._kept = self._content(arm)

    def keep(self, arm: Arm) -> None:
        """Begin to write the changes, if there are any; called in each cycle."""
        content = self._content(arm)
        if self._path is None or all(a is b for a, b in zip(content, self._kept, strict=True)):
            return
        self._kept = content
        space = arm.workspace
        bench = _Bench(1, scene_value(space.scene), space.tool.name, space.load, arm.jaws.held)
        self._writer.submit(self._write, self._path, msgspec.json.encode(bench))

    @staticmethod
    def _content(arm: Arm) -> tuple[object, ...]:
        space = arm.workspace
        return space.scene, space.tool, space.load, arm.jaws.held

    def _read(self) -> _Bench | None:
        if self._path is None:
            return None
        try:
            return msgspec.json.decode(self._path.read_bytes(), type=_Bench)
        except FileNotFoundError:
            return None
        except (OSError, msgspec.DecodeError, BioscaraError) as error:
            raise self._unusable(str(error)) from error

    def _unusable(self, reason: str) -> ConfigurationError:
        return ConfigurationError(
            f"{self._path}: what the last owner knew of the bench cannot be used: {reason}; look "
            "what stands there and what the arm carries, then remove the file"
        )

    @staticmethod
    def _write(path: Path, data: bytes) -> None:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with replacing(path) as partial:
                partial.write_bytes(data)
        except OSError as error:
            _log.warning(
                "%s: the scene and the load cannot be kept for the next owner: %s",
                path,
                error.strerror or error,
            )


def _with_bench(
    space: Workspace, bench: _Bench, *, restored: bool
) -> tuple[Workspace, frozenset[WorkspacePart]]:
    """Return the workspace of the last owner, and the parts of it that somebody has to look at."""
    usual, unconfirmed = space, set()
    if restored:
        space = space.with_scene(replace(scene_of(bench.scene), widths=space.scene.widths))
        if space.scene != usual.scene:
            unconfirmed.add(WorkspacePart.SCENE)
    if bench.tool != space.tool.name:
        space = space.with_tool(bench.tool)
        unconfirmed.add(WorkspacePart.TOOL)
    if bench.load is not None:
        space = space.with_load(bench.load)
        unconfirmed.add(WorkspacePart.LOAD)
    return space, frozenset(unconfirmed)
