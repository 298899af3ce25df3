"""Generate the description of the arm: meshes and masses from its drawing, URDF, SRDF from xacro.

``make generate`` writes the files, ``make fresh`` compares them. Both need the ``xacro`` package,
which comes with the ``dev`` extra; reading the description does not need it.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from bioscara.errors import ConfigurationError
from bioscara.model import load_parameters
from bioscara.model.loading import EXISTING_ARMS
from bioscara.model.parts import MASSES
from bioscara.model.urdf import DESCRIPTION, SRDF, URDF
from tools import generated
from tools.generated import update
from tools.meshes import files

_HEADER = """<?xml version="1.0"?>
<!-- Generated from parameters.yaml and {source}: edit those, then make generate. -->
"""


def render(source: Path, **arguments: str) -> str:
    """Return an expanded xacro file.

    Args:
        source: The file.
        arguments: Values of its ``<xacro:arg>`` tags.

    Raises:
        ConfigurationError: The file cannot be expanded, or the ``xacro`` package is missing.
    """
    xacro = _xacro()
    try:
        document = xacro.process_file(str(source), mappings=arguments)
    except xacro.XacroException as error:
        raise ConfigurationError(f"{source.name}: {error}") from error
    root = document.documentElement
    _strip(root)
    body: str = root.toprettyxml(indent="  ")
    return _HEADER.format(source=source.name) + body


def _xacro() -> Any:
    # Installed only where the description is generated.
    try:
        import xacro  # noqa: PLC0415
    except ImportError as error:
        raise ConfigurationError(
            "the description is expanded with xacro: pip install 'bioscara[dev]'"
        ) from error
    return xacro


def _strip(node: Any) -> None:
    """Remove comments, which concern the source, and the blank text between elements."""
    for child in list(node.childNodes):
        if child.nodeType == child.COMMENT_NODE or (
            child.nodeType == child.TEXT_NODE and not child.data.strip()
        ):
            node.removeChild(child)
        else:
            _strip(child)


def write(folder: Path, *, check: bool = False) -> list[Path]:
    """Bring every generated file of the description up to date.

    Args:
        folder: The description, with its xacro files.
        check: Whether to write nothing.

    Returns:
        The files that were outdated, or that are no longer generated.
    """
    drawn = files(load_parameters(EXISTING_ARMS).geometry)
    wanted = {folder / name: content for name, content in drawn.items()}
    stale = update(wanted, check=check, there=folder.glob("meshes/*/*.stl"))
    for target in (URDF, SRDF):
        # Of the files before, which it includes.
        text = render(folder / f"{target.name}.xacro")
        if target is URDF:
            text = text.replace("-->\n", f"-->\n<!-- {MASSES} -->\n", 1)
        stale += update({folder / target.name: text}, check=check)
    return stale


def main(arguments: list[str] | None = None) -> int:
    """Write or check the generated files; return the exit status."""
    return generated.main(lambda check: write(DESCRIPTION, check=check), arguments)


if __name__ == "__main__":
    sys.exit(main())
