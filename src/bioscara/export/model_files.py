"""A folder with the model of the arm for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from bioscara.errors import ConfigurationError, InvalidArgumentError
from bioscara.files.whole_files import new_folder
from bioscara.model import ArmParameters

Format = Literal["mjcf", "urdf", "glb"]
"""MuJoCo's own format; the robot description; the look of the arm, as binary glTF."""


def export_model(form: Format, folder: Path, parameters: ArmParameters) -> tuple[str, ...]:
    """Write the model of an arm into a new folder, all of it or nothing.

    Args:
        form: Its format.
        folder: The folder; it must not exist, or be empty and not the working folder.
        parameters: The arm.

    Returns:
        The files by their paths in the folder, the one to load first.

    Raises:
        InvalidArgumentError: The folder is not such a one.
        ConfigurationError: It cannot be written; or the meshes of this arm would be others than
            those of the package.
        NotSupportedError: ``mjcf`` needs MuJoCo, which is not installed.
    """
    try:
        # An empty folder is replaced, which the shell in it would not notice.
        if folder.exists() and (
            not folder.is_dir() or any(folder.iterdir()) or folder.samefile(Path())
        ):
            raise InvalidArgumentError(
                f"{folder} is neither a new folder nor an empty one elsewhere: name another one"
            )
        files = _files(form, parameters)
        with new_folder(folder) as partial:
            for name, content in files.items():
                (partial / name).parent.mkdir(parents=True, exist_ok=True)
                (partial / name).write_bytes(content)
    except OSError as error:
        raise ConfigurationError(
            f"{folder} cannot be written: {error.strerror or error}; name a folder that can"
        ) from error
    return tuple(files)


def _files(form: Format, parameters: ArmParameters) -> dict[str, bytes]:
    # Imported here: each format needs another part of the package.
    from bioscara.export.portable_urdf import portable_urdf  # noqa: PLC0415

    if form == "glb":
        from bioscara.export.glb import glb  # noqa: PLC0415

        return {"bioscara.glb": glb(parameters)}
    urdf, meshes = portable_urdf(parameters)
    if form == "urdf":
        return {"bioscara.urdf": urdf.encode(), **meshes}
    from bioscara.physics.mjcf import mjcf  # noqa: PLC0415

    text = mjcf(parameters, urdf, meshes)
    return {"bioscara.xml": text.encode()} | {
        name: content for name, content in meshes.items() if f'"{name}"' in text
    }
