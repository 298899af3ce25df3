"""How arms of other processes are found, by the prefix of their names: ``arm`` of ``arm:NAME``."""

from __future__ import annotations

from collections.abc import Callable

from bioscara.robot.arm_methods import ArmMethods

Opener = Callable[[str, float], ArmMethods]
"""Returns the robot of a name without its prefix, and the longest time to wait for it [s]."""

OPENERS: dict[str, Opener] = {}
"""The openers; :mod:`bioscara.connect`, which is above robots and their clients, adds them."""
