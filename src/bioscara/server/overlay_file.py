"""The overlay of the parameters: read and replaced whole, with a revision number."""

from __future__ import annotations

import tempfile
import threading
from pathlib import Path

from bioscara.api.messages import ParametersState
from bioscara.errors import ConfigurationError, ConflictError
from bioscara.model import load_parameters
from bioscara.whole_files import replacing

_LONGEST = 1 << 20
"""Longest overlay that is accepted [characters]."""


class OverlayFile:
    """The file with the values in which this arm differs.

    Args:
        path: The file; None if the owner has none.
    """

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self._revision, self._restart = 1, False
        self._lock = threading.Lock()

    def state(self) -> ParametersState:
        """Return the file's content and its revision.

        Raises:
            OSError: It cannot be read.
        """
        text = "" if self._path is None else self._path.read_text(encoding="utf-8")
        return ParametersState(self._revision, text, self._restart)

    def write(self, text: str, revision: int) -> ParametersState:
        """Check the values and replace the file; they apply when the owner starts again.

        Args:
            text: The new content.
            revision: Revision that it replaces.

        Raises:
            ConfigurationError: The owner has no overlay, or the values cannot be used.
            ConflictError: Another client has replaced the file since.
            OSError: It cannot be written; the former file is unchanged.
        """
        if self._path is None:
            raise ConfigurationError(
                "the owner has no file for parameters; start it with serve --parameters FILE"
            )
        if len(text) > _LONGEST:
            raise ConfigurationError(f"the overlay has {len(text)} characters, over {_LONGEST}")
        with tempfile.TemporaryDirectory() as folder:
            draft = Path(folder, self._path.name)
            draft.write_text(text, encoding="utf-8")
            load_parameters(overlay=draft)
        with self._lock:
            if revision != self._revision:
                raise ConflictError(
                    f"another client has changed the overlay, which is number {self._revision} "
                    "now; read it again and repeat the change",
                    self._revision,
                )
            with replacing(self._path) as partial:
                partial.write_text(text, encoding="utf-8")
            self._revision += 1
            self._restart = True
        return ParametersState(self._revision, text, restart=True)
