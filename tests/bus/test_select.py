"""Buses by name."""

from __future__ import annotations

import pytest

from bioscara.bus import LinuxBus, open_bus
from bioscara.errors import InvalidArgumentError


@pytest.mark.parametrize(
    ("name", "path"),
    [
        ("linux:1", "/dev/i2c-1"),
        ("linux:22", "/dev/i2c-22"),
        ("linux:/dev/i2c-3", "/dev/i2c-3"),
        ("linux:/dev/serial/by-path/arm:0", "/dev/serial/by-path/arm:0"),
    ],
)
def test_a_name_gives_the_bus_without_touching_it(name: str, path: str) -> None:
    bus = open_bus(name)
    assert isinstance(bus, LinuxBus)
    assert bus.path == path


@pytest.mark.parametrize(
    "name", ["", "linux", "linux:", "linux:-1", "linux:one", "linux:²", "Linux:1", "1", "usb:1"]
)
def test_a_wrong_name_is_refused_with_the_forms_allowed(name: str) -> None:
    with pytest.raises(InvalidArgumentError) as caught:
        open_bus(name, other_forms=("sim",))
    text = str(caught.value)
    assert repr(name) in text
    assert "sim, linux:1" in text
    assert "linux:/dev/i2c-1" in text
