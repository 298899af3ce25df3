"""The arm's committed limits, as planning takes them."""

from __future__ import annotations

import math

from bioscara.model import load_parameters
from bioscara.planning.limits import MotionLimits

LIMITS = load_parameters().joints
NAMES = tuple(limit.name for limit in LIMITS)
ROUGH = [MotionLimits.of(limit)._replace(max_jerk=math.inf) for limit in LIMITS]
"""The same without a limit of the jerk."""
