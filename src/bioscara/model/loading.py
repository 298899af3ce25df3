"""Load a parameter file; every error names file, line, key, value and limit.

The values of the committed file come from the module that is generated from it, without the YAML
parser and the checks, unless the file was changed since.
"""

from __future__ import annotations

import os
import zlib
from functools import lru_cache
from pathlib import Path

from bioscara.arguments import OVERLAY_VARIABLE
from bioscara.errors import ConfigurationError
from bioscara.model import existing_arms
from bioscara.model.overlay import Overlay
from bioscara.model.parameters import JOINTS, ArmParameters, ambiguous_address
from bioscara.model.validation import dotted
from bioscara.model.yaml_file import YamlFile, read_text

EXISTING_ARMS = Path(__file__).with_name("parameters.yaml")
"""File with the values of the existing arms."""


def own_parameters() -> ArmParameters:
    """Return the parameters of this computer's arm, with the overlay of its user.

    The environment variable ``BIOSCARA_PARAMETERS`` names the overlay; without it the arm is as the
    existing ones.

    Raises:
        ConfigurationError: As :func:`load_parameters`.
    """
    return load_parameters(overlay=os.environ.get(OVERLAY_VARIABLE) or None)


def load_parameters(
    path: Path | str | None = None, *, overlay: Path | str | None = None
) -> ArmParameters:
    """Return the arm's parameters from a YAML file, checked.

    Args:
        path: The file; None for the values of the existing arms, which come with the package
            (``parameters.yaml`` is an example).
        overlay: File with the values in which this arm differs, such as its calibration: the same
            names, any part of them. They are merged over those of ``path`` and checked with them.

    Raises:
        ConfigurationError: A file cannot be read, a key is unknown or missing, a value is outside
            its range or contradicts another one, or the overlay changes a value that it cannot.
    """
    if path is None and overlay is None and checksum(EXISTING_ARMS) == existing_arms.CHECKSUM:
        return existing_arms.parameters()
    file = existing_file() if path is None else _complete_file(Path(path))
    if overlay is None:
        return ArmParameters.checked(file.values, file.place)
    both = Overlay(file, YamlFile.load(Path(overlay), str(overlay)))
    return ArmParameters.checked(both.values, both.place, contradicted=True)


def existing_file() -> YamlFile:
    """Return the values of the existing arms with their lines, not to be changed.

    Raises:
        ConfigurationError: The file cannot be read.
    """
    return _parsed(read_text(EXISTING_ARMS, EXISTING_ARMS.name))


def _complete_file(path: Path) -> YamlFile:
    """Return the values of a file; refuse addresses that the original reads as other ones."""
    file = YamlFile.load(path, str(path))
    for name in JOINTS:
        location = "joints", name, "address"
        value = file.at(location)
        # A hexadecimal number is of another type, which remembers how it was written.
        if type(value) is int and (problem := ambiguous_address(str(value))):
            raise ConfigurationError(f"{file.place(location)}{dotted(location)}: {problem}")
    return file


@lru_cache(maxsize=1)
def _parsed(text: str) -> YamlFile:
    # A server with an overlay reads the same text at each change of a value: 15 ms.
    return YamlFile(text, EXISTING_ARMS.name)


def checksum(path: Path) -> int:
    """Return a number that changes with the content of a file.

    Raises:
        ConfigurationError: The file cannot be read.
    """
    try:
        return zlib.crc32(path.read_bytes())
    except OSError as error:
        raise ConfigurationError(f"{path.name}: {error.strerror or error}") from error
