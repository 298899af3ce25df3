"""Load a parameter file; every error names file, line, key, value and limit."""

from __future__ import annotations

from pathlib import Path

from bioscara.model.parameters import ArmParameters
from bioscara.model.yaml_file import YamlFile

_EXISTING_ARMS = Path(__file__).with_name("parameters.yaml")


def load_parameters(path: Path | None = None) -> ArmParameters:
    """Return the arm's parameters from a YAML file, checked.

    Args:
        path: The file; None for the values of the existing arms, which come with the package
            (``parameters.yaml`` is an example).

    Raises:
        ConfigurationError: The file cannot be read, a key is unknown or missing, or a value is
            outside its range.
    """
    file = YamlFile.load(path or _EXISTING_ARMS, str(path or _EXISTING_ARMS.name))
    return ArmParameters.checked(file.values, file.place)
