"""The arms that the commands simulate stand close to their end stops, so that homing is short."""

from __future__ import annotations

import pytest


@pytest.fixture(autouse=True, scope="module")
def short_homing(near_the_stops: None) -> None:
    """Use the arms of ``near_the_stops`` in every module here."""
