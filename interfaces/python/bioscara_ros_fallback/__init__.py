"""Interface packages of ROS 2, found only where nothing else provides them.

Python imports this module when it starts. The packages lie in its folder, which is not on
``sys.path``: only after all other finders have looked for a package in vain, it is taken from here.
Those of a ROS installation, of a colcon workspace or of other wheels are thus always preferred.
"""

from __future__ import annotations

import os
import sys

FOLDER = os.path.dirname(os.path.abspath(__file__))


class FallbackFinder:
    """Finds the packages of this folder, and nothing else."""

    @staticmethod
    def find_spec(name: str, path: object = None, _target: object = None) -> object:
        """Find a package, as the import system asks.

        Args:
            name: Name of the module.
            path: None for a module that is in no package; others are not from here.
            _target: Not used.

        Returns:
            The specification of the module, or None.
        """
        file = os.path.join(FOLDER, name, "__init__.py")
        if path is not None or "." in name or not os.path.isfile(file):
            return None
        from importlib.machinery import PathFinder  # each start of Python would pay for it

        return PathFinder.find_spec(name, [FOLDER])


if not any(isinstance(finder, FallbackFinder) for finder in sys.meta_path):
    sys.meta_path.append(FallbackFinder())
