"""Bytes that are no message, or a part of one, are refused."""

from __future__ import annotations

from contextlib import suppress

import pytest
from hypothesis import given, strategies as st

from bioscara.errors import RecordingError
from bioscara.rosbag.cdr import CdrMessage, CdrReader


@given(st.binary(max_size=64))
def test_bytes_that_are_no_message_are_refused(data: bytes) -> None:
    with suppress(RecordingError):
        reader = CdrReader(data)
        reader.stamp()
        reader.strings()
        reader.double_values()


def test_a_message_that_was_cut_off_is_refused_wherever_it_was() -> None:
    message = CdrMessage()
    message.strings(("a", "bc"))
    message.double_sequence((1.0, 2.0))
    whole = bytes(message.data)
    reader = CdrReader(whole)
    assert (reader.strings(), reader.double_values()) == (("a", "bc"), (1.0, 2.0))
    for length in range(len(whole)):

        def read(part: bytes = whole[:length]) -> None:
            reader = CdrReader(part)
            reader.strings()
            reader.double_values()

        with pytest.raises(RecordingError):
            read()
