"""The robot description that comes with the package.

It is generated from ``parameters.yaml``, the xacro files next to it and the drawing in ``parts`` by
``tools/description.py``; ``make check`` compares.
"""

from __future__ import annotations

from pathlib import Path

DESCRIPTION = Path(__file__).with_name("description")
"""Folder of the description."""
URDF = DESCRIPTION / "bioscara.urdf"
"""The expanded robot description of the existing arms."""
SRDF = DESCRIPTION / "bioscara.srdf"
"""Groups, states and pairs of links that never touch."""
