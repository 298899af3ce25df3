"""Last width of the gripper, in a file that is always complete."""

from __future__ import annotations

import json
import logging
import os
from pathlib import Path

from bioscara.errors import GripperError

_SIZE_MAX = 1024
"""Bytes that are read of a file: a width takes forty."""
_log = logging.getLogger(__name__)


def read_width(path: Path, lower: float, upper: float, default: float) -> float:
    """Return the width in ``path`` [m], or ``default`` if there is no file.

    A file that holds no width between ``lower`` and ``upper`` counts as none, with a warning.
    """
    try:
        with path.open("rb") as file:
            text = file.read(_SIZE_MAX).decode()
    except FileNotFoundError:
        return default
    except (OSError, UnicodeDecodeError) as error:
        _log.warning("%s: cannot be read (%s); assuming %g m", path, error, default)
        return default
    try:
        width = json.loads(text)["width"]
        valid = not isinstance(width, bool) and lower <= width <= upper
    except (ValueError, TypeError, KeyError, RecursionError):
        valid = False
    if not valid:
        _log.warning(
            "%s: holds no width from %g to %g m; assuming %g m", path, lower, upper, default
        )
        return default
    return float(width)


def write_width(path: Path, width: float) -> None:
    """Write ``width`` [m] to ``path`` atomically: on failure the file is unchanged.

    Raises:
        GripperError: The file cannot be written.
    """
    temporary = path.with_name(path.name + ".new")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with temporary.open("w") as file:
            file.write(json.dumps({"width": width}) + "\n")
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
        folder = os.open(path.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)
    except OSError as error:
        raise GripperError(
            f"{path}: the gripper's width cannot be kept ({error.strerror}); give a state file "
            "that can be written"
        ) from error
