"""Commands that install missing packages, to be pasted into a shell."""

from __future__ import annotations

import shlex
import sys
from importlib.util import find_spec
from typing import Literal

from bioscara.errors import NotSupportedError

Extra = Literal["plot", "export", "web", "physics", "physics-view"]
"""The extras of ``pyproject.toml`` that users need."""


def require(package: str, what: str, command: str) -> None:
    """Raise if an optional package is missing; it is not imported.

    Args:
        package: Name of the package.
        what: What needs it, for the message.
        command: Installs it.

    Raises:
        NotSupportedError: It is not installed; the message has the command.
    """
    if find_spec(package) is None:
        raise NotSupportedError(f"{what} needs {package}, which is not installed: {command}")


def install(extra: Extra) -> str:
    """Return the command that installs an extra of this package."""
    return pip_install(f"bioscara[{extra}]")


def pip_install(*what: str, python: str = sys.executable) -> str:
    """Return the command that installs packages, with options of pip.

    Args:
        what: The packages and options.
        python: For which Python; by default for the one that runs.
    """
    return shlex.join((python, "-m", "pip", "install", *what))
