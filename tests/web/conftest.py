"""Fixtures of the tests of the gateway."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from web.gateways import Site, site


@pytest.fixture(scope="module")
def left() -> Iterator[Site]:
    """A gateway that the tests of a module share."""
    with site("left") as made:
        yield made


@pytest.fixture(autouse=True, scope="module")
def short_homing(near_the_stops: None) -> None:
    """Use the arms of ``near_the_stops`` in every module here."""
