"""Statistics of the cycles, while another thread asks for them."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator

import numpy as np
import pytest

from bioscara.control.manager.statistics import Histogram, Spread


@pytest.fixture(autouse=True)
def switching() -> Iterator[None]:
    """Let threads take turns as often as the interpreter can."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(before)


@pytest.mark.parametrize("kind", [Histogram, Spread])
def test_a_thread_may_ask_while_another_one_adds(kind: type[Histogram | Spread]) -> None:
    counted, raised = kind(), []
    values = np.random.default_rng(5).uniform(1e-5, 1e-2, 60_000).tolist()
    ended = threading.Event()

    def ask() -> None:
        try:
            while not ended.is_set():
                if isinstance(counted, Histogram):
                    counted.percentile(99.0)
                else:
                    counted.summary()
        except Exception as error:  # noqa: BLE001  judged below
            raised.append(error)

    asking = threading.Thread(target=ask)
    asking.start()
    try:
        for value in values:
            counted.add(value)
    finally:
        ended.set()
        asking.join()
    assert raised == []
    if isinstance(counted, Histogram):
        assert counted.maximum == max(values)
        assert counted.percentile(50.0) == pytest.approx(np.median(values), rel=1 / 16)
    else:
        assert counted.summary().average == pytest.approx(np.mean(values), rel=1e-3)
