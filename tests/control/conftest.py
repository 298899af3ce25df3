from __future__ import annotations

from collections.abc import Iterator

import pytest

from bioscara.hardware import LifecycleState
from control.control_stack import World
from control.scripted_controller import release


@pytest.fixture(scope="module")
def homed() -> World:
    return World(at={"j1": 0.0, "j2": 0.2, "j3": 0.0, "j4": 0.0})


@pytest.fixture
def world(homed: World) -> Iterator[World]:
    """The homed arm without controllers but the hold; a test leaves its hardware ACTIVE."""
    yield homed
    active = [
        each.name for each in homed.manager.controllers if each.state is LifecycleState.ACTIVE
    ]
    release(homed)
    homed.switch(off=tuple(active))
    for _ in range(2):
        for controller in homed.manager.controllers:
            if controller.name != "hold":
                homed.manager.unload(controller.name)
    homed.run(0.2)


@pytest.fixture
def unhomed() -> World:
    return World(home=False)
