"""The arms that the commands simulate stand close to their end stops, so that homing is short."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from simulated import standing_near_the_stops


@pytest.fixture(autouse=True, scope="module")
def near_the_stops() -> Iterator[None]:
    with standing_near_the_stops():
        yield
