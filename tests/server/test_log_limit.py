"""How many lines of one cause a log has."""

from __future__ import annotations

import logging
from collections.abc import Iterator

import pytest

from bioscara.server.log_limit import LINES, PERIOD, LogLimit


class Lines(logging.Handler):
    def __init__(self) -> None:
        super().__init__()
        self.lines: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.lines.append(record.getMessage())


@pytest.fixture
def handlers() -> Iterator[tuple[Lines, Lines]]:
    logger, made = logging.getLogger("limited"), (Lines(), Lines())
    logger.propagate = False
    logger.handlers[:] = made
    yield made
    logger.handlers.clear()


def test_lines_of_a_cause_are_counted_and_others_are_written(
    handlers: tuple[Lines, Lines],
) -> None:
    now = 0.0
    limit, logger = LogLimit(lambda: now), logging.getLogger("limited")
    for each in handlers:
        each.addFilter(limit)

    def complain(number: int) -> None:
        logger.warning("file %d cannot be opened", number)

    for number in range(10_000):
        complain(number)
        now += 1e-3 * (PERIOD / 20)
    logger.warning("something else")
    now = PERIOD
    for number in range(2):
        complain(number)
    shown, kept = (each.lines for each in handlers)
    assert shown == kept
    assert len(shown) == LINES + 1 + 2
    assert shown[0] == "file 0 cannot be opened"
    assert shown[LINES - 1].endswith(f"(further ones like it are left out for {PERIOD:g} s)")
    assert shown[LINES:] == [
        "something else",
        f"file 0 cannot be opened (and {10_000 - LINES} more like it before)",
        "file 1 cannot be opened",
    ]
