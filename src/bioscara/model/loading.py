"""Load a parameter file; every error names file, line, key, value and limit."""

from __future__ import annotations

import os
from pathlib import Path

from bioscara.arguments import OVERLAY_VARIABLE
from bioscara.model.overlay import Overlay
from bioscara.model.parameters import ArmParameters
from bioscara.model.yaml_file import YamlFile

_EXISTING_ARMS = Path(__file__).with_name("parameters.yaml")


def own_parameters() -> ArmParameters:
    """Return the parameters of this computer's arm, with the overlay of its user.

    The environment variable ``BIOSCARA_PARAMETERS`` names the overlay; without it the arm is as the
    existing ones.

    Raises:
        ConfigurationError: As :func:`load_parameters`.
    """
    return load_parameters(overlay=os.environ.get(OVERLAY_VARIABLE) or None)


def load_parameters(
    path: Path | None = None, *, overlay: Path | str | None = None
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
    file = YamlFile.load(path or _EXISTING_ARMS, str(path or _EXISTING_ARMS.name))
    if overlay is None:
        return ArmParameters.checked(file.values, file.place)
    both = Overlay(file, YamlFile.load(Path(overlay), str(overlay)))
    return ArmParameters.checked(both.values, both.place, contradicted=True)
