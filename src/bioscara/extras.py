"""Commands that install missing packages, to be pasted into a shell."""

from __future__ import annotations

import shlex
import sys
from typing import Literal

Extra = Literal["plot", "export", "web"]
"""The extras of ``pyproject.toml`` that users need."""


def install(extra: Extra) -> str:
    """Return the command that installs an extra of this package."""
    return pip_install(f"bioscara[{extra}]")


def pip_install(*what: str) -> str:
    """Return the command that installs packages, with options of pip, for the Python that runs."""
    return shlex.join((sys.executable, "-m", "pip", "install", *what))
