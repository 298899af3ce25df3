"""Bioscara: the software of a four-axis SCARA lab arm, from the wire to ROS 2."""

from __future__ import annotations

__version__ = "0.1.0"
