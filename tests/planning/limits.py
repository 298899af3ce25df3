"""The arm's committed limits, as planning takes them."""

from __future__ import annotations

from bioscara.model import load_parameters

LIMITS = load_parameters().joints
NAMES = tuple(limit.name for limit in LIMITS)
