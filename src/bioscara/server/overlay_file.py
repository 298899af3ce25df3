"""The overlay of the parameters: read and replaced whole, with a revision number."""

from __future__ import annotations

import threading
from pathlib import Path

from bioscara.api.messages import ParametersState
from bioscara.errors import ConfigurationError, ConflictError
from bioscara.files.locked_folder import LockedFolder
from bioscara.files.whole_files import replacing
from bioscara.model import load_parameters

_LONGEST = 1 << 20
"""Longest overlay that is accepted [characters]."""


class OverlayFile:
    """The file with the values in which this arm differs.

    Args:
        path: The file, from which the owner has read its parameters; None if it has none.

    Raises:
        OSError: It cannot be read.
    """

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self._text = self._applied = self._read()
        self._revision = 1
        self._lock = threading.Lock()

    def state(self) -> ParametersState:
        """Return the file's content and its revision.

        Raises:
            OSError: It cannot be read.
        """
        with self._lock:
            return self._present()

    def write(self, text: str, revision: int) -> ParametersState:
        """Check the values and replace the file; they apply when the owner starts again.

        Args:
            text: The new content.
            revision: Revision that it replaces.

        Raises:
            ConfigurationError: The owner has no overlay, or the values cannot be used.
            ConflictError: Another client or an editor has changed the file since.
            OSError: It cannot be written; the former file is unchanged.
        """
        if self._path is None:
            raise ConfigurationError(
                "the owner has no file for parameters; start it with serve --parameters FILE"
            )
        if len(text) > _LONGEST:
            raise ConfigurationError(f"the overlay has {len(text)} characters, over {_LONGEST}")
        with LockedFolder("bioscara-overlay-") as folder:
            draft = folder / self._path.name
            draft.write_text(text, encoding="utf-8")
            load_parameters(overlay=draft)
        with self._lock:
            present = self._present()
            if revision != present.revision:
                raise ConflictError(
                    f"the overlay was changed since, by another client or an editor, and is number "
                    f"{present.revision} now; read it again and repeat the change",
                    present.revision,
                )
            with replacing(self._path) as partial:
                partial.write_text(text, encoding="utf-8")
            return self._present()

    def _present(self) -> ParametersState:
        text = self._read()
        if text != self._text:
            self._text, self._revision = text, self._revision + 1
        return ParametersState(self._revision, text, restart=text != self._applied)

    def _read(self) -> str:
        return "" if self._path is None else self._path.read_text(encoding="utf-8")
