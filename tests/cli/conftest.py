"""The arms that the commands simulate stand close to their end stops, so that homing is short."""

from __future__ import annotations

import logging
from collections.abc import Iterator

import pytest

from cli.said import Said


@pytest.fixture(autouse=True, scope="module")
def short_homing(near_the_stops: None) -> None:
    """Use the arms of ``near_the_stops`` in every module here."""


@pytest.fixture(autouse=True)
def own_log() -> Iterator[None]:
    """Remove the handlers of a served arm's log, whose stream is closed when the test ends."""
    root = logging.getLogger()
    before = root.handlers[:]
    yield
    root.handlers[:] = [handler for handler in root.handlers if handler in before]


@pytest.fixture
def said(capsys: pytest.CaptureFixture[str]) -> Said:
    """Runs commands and returns what they write."""
    return Said(capsys)
