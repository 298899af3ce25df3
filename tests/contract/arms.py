"""The arm behind every bus of the contract: the compiled firmware."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from bioscara.bus import Bus


def open_arm() -> Bus:
    """Return a bus with four joints in virtual time, just switched on."""
    # Half of this folder runs without the native simulation and must be collected without it.
    from bioscara.sim import FirmwareBus  # noqa: PLC0415

    return FirmwareBus()


@contextmanager
def served_arm(path: Path) -> Iterator[Bus]:
    """Serve such an arm in real time behind a socket, and yield a bus to it, not yet used."""
    from bioscara.sim import SimulatedArm, SocketBus, serve  # noqa: PLC0415

    ended, listening = threading.Event(), threading.Event()

    thread = threading.Thread(
        target=serve,
        args=(SimulatedArm(), path, ended.is_set),
        kwargs={"listening": listening.set},
    )
    thread.start()
    try:
        assert listening.wait(10)
        with SocketBus(path) as bus:
            yield bus
    finally:
        ended.set()
        thread.join(10)
        assert not thread.is_alive()
