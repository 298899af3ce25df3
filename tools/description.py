"""Generate the description of the arm: meshes and masses from its drawing, URDF, SRDF from xacro.

``make generate`` writes the files, ``make fresh`` compares them. Both need the ``xacro`` package,
which comes with the ``dev`` extra; reading the description does not need it.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from bioscara.errors import ConfigurationError
from bioscara.model import load_parameters
from bioscara.model.loading import EXISTING_ARMS
from bioscara.model.urdf import DESCRIPTION, SRDF, URDF
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


def write(folder: Path, *, check: bool = False) -> list[str]:
    """Bring every generated file of the description up to date.

    Args:
        folder: The description, with its xacro files.
        check: Whether to write nothing.

    Returns:
        Names of the files that were outdated, or that are no longer generated.
    """
    wanted = files(load_parameters(EXISTING_ARMS).geometry)
    stale = _update(folder, wanted, check=check)
    for target in (URDF, SRDF):
        text = render(folder / f"{target.name}.xacro")
        stale += _update(folder, {target.name: text.encode()}, check=check)
    for path in sorted(folder.glob("meshes/*/*.stl")):
        name = path.relative_to(folder).as_posix()
        if name not in wanted:
            stale.append(name)
            if not check:
                path.unlink()
    return stale


def _update(folder: Path, wanted: dict[str, bytes], *, check: bool) -> list[str]:
    stale = []
    for name, content in wanted.items():
        path = folder / name
        if path.is_file() and path.read_bytes() == content:
            continue
        stale.append(name)
        if not check:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
    return stale


def main(arguments: list[str] | None = None) -> int:
    """Write or check the generated files; return the exit status."""
    parser = argparse.ArgumentParser(description="Generate the description of the arm.")
    parser.add_argument("--check", action="store_true", help="write nothing, fail when stale")
    options = parser.parse_args(arguments)
    try:
        stale = write(DESCRIPTION, check=options.check)
    except ConfigurationError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    if stale and options.check:
        sys.stderr.write(f"{', '.join(stale)}: stale; run make generate\n")
        return 1
    for name in stale:
        sys.stdout.write(f"wrote {name}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
