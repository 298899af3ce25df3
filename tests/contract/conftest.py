"""Every kind of bus, each in front of the same compiled firmware."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from bioscara.bus import Bus, FaultyBus, TracingBus
from bioscara.clock import MonotonicClock
from bus.wire import Wire
from contract.arm_server import ArmServer
from contract.arms import open_arm, served_arm
from contract.preload import PreloadedBus, build_shim

BUSES = (
    "firmware",
    "recording",
    "faulty",
    "socket",
    "linux",
    "linux-pi4",
    "linux-pi5",
)


@pytest.fixture(scope="session")
def shim(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The preload library."""
    return build_shim(tmp_path_factory.mktemp("shim"))


@pytest.fixture
def open_linux(shim: Path, tmp_path: Path) -> Iterator[Callable[..., PreloadedBus]]:
    """Opens a Linux bus in a process of its own; arguments: the rules, the devices on the bus."""
    with ExitStack() as stack:

        def open_bus(rules: str = "", arm: Bus | None = None) -> PreloadedBus:
            server = stack.enter_context(ArmServer(arm or Wire(), tmp_path / "arm"))
            bus = PreloadedBus(shim, server.path, rules)
            stack.callback(bus.quit)
            return bus

        yield open_bus


@pytest.fixture(params=BUSES)
def bus(
    request: pytest.FixtureRequest, open_linux: Callable[..., PreloadedBus], tmp_path: Path
) -> Iterator[Bus]:
    """Each kind of bus with four joints on it, not yet used."""
    kind, _, rules = str(request.param).partition("-")
    if kind == "socket":
        with served_arm(tmp_path / "arm.sock") as arm:
            yield arm
        return
    arm = open_arm()
    if kind == "linux":
        arm = open_linux(rules, arm)
    elif kind == "recording":
        arm = TracingBus(arm, tmp_path / "recording", MonotonicClock())
    elif kind == "faulty":
        arm = FaultyBus(arm, 1)
    with arm:
        yield arm
