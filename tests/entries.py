"""Tests that go through many entries: the one that fails is named in the message."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def entry(name: object) -> Iterator[None]:
    """Name an entry with each failure in the block."""
    try:
        yield
    except BaseException as error:
        error.add_note(f"entry: {name}")
        raise
