"""The physics engine, which is an extra."""

from __future__ import annotations

import os
from importlib import import_module
from importlib.util import find_spec
from types import ModuleType

from bioscara.errors import NotSupportedError
from bioscara.extras import install

OLDEST = (3, 4)
"""Oldest version of MuJoCo with which the world is tested."""


def mujoco(what: str = "a world") -> ModuleType:
    """Return the module ``mujoco``.

    Args:
        what: What needs it, for the message.

    Raises:
        NotSupportedError: It is not installed, damaged or too old; names the command to install it.
    """
    remedy = install("physics")
    try:
        module = import_module("mujoco")
    except ImportError as error:
        missing = isinstance(error, ModuleNotFoundError) and error.name == "mujoco"
        why = "is not installed" if missing else f"cannot be loaded ({error})"
        raise NotSupportedError(
            f"{what} needs the physics engine MuJoCo, which {why}: {remedy}"
        ) from error
    # It imports what $MUJOCO_GL chooses, and of that any error.
    except Exception as error:
        raise NotSupportedError(
            f"{what} needs the physics engine MuJoCo, which cannot be loaded ({error}) with "
            f"MUJOCO_GL={os.environ.get('MUJOCO_GL', '')}: leave the variable out"
        ) from error
    version: str = module.__version__
    if tuple(int(part) for part in version.split(".")[:2]) < OLDEST:
        oldest = ".".join(map(str, OLDEST))
        raise NotSupportedError(
            f"{what} needs MuJoCo {oldest} or newer, and {version} is installed: {remedy}"
        )
    return module


def is_installed() -> bool:
    """Return whether there is a module ``mujoco``, of any version."""
    return find_spec("mujoco") is not None
