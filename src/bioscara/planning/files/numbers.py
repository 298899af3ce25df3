"""Number format of trajectory files."""

from __future__ import annotations

import re

from bioscara.arguments import shown
from bioscara.errors import TrajectoryError

_NUMBER = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")


def number(text: str, where: str) -> float:
    """Parse the decimal number in ``text``.

    ``float`` accepts more than a planner writes: ``1_0.0``, ``infinity``, digits of other scripts.

    Raises:
        TrajectoryError: It is not a decimal number; the message begins with ``where``.
    """
    if _NUMBER.fullmatch(text) is None:
        raise TrajectoryError(
            f"{where}: {shown(text)} is not a number; write it like -0.25 or 1e-3"
        )
    return float(text)
