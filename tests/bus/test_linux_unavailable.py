"""A Linux bus that cannot be opened names the missing part and the remedy."""

from __future__ import annotations

import fcntl
import math
import os
import subprocess
import sys
from pathlib import Path

import pytest

from bioscara.bus import LinuxBus, Transaction
from bioscara.errors import BusUnavailableError, InvalidArgumentError, LimitError

PING = [Transaction(0x11, b"\x0f", 2)]


def test_a_missing_device_is_reported_with_the_buses_that_exist(tmp_path: Path) -> None:
    for number in (10, 2, 1):
        (tmp_path / f"i2c-{number}").touch()
    with pytest.raises(BusUnavailableError) as caught:
        LinuxBus(str(tmp_path / "i2c-7")).transfer(PING)
    assert (
        f"{tmp_path}/i2c-7 does not exist (buses that exist: "
        f"{tmp_path}/i2c-1, {tmp_path}/i2c-2, {tmp_path}/i2c-10)" in str(caught.value)
    )
    assert caught.value.code == -2


def test_where_no_bus_exists_the_remedy_is_to_switch_i2c_on(tmp_path: Path) -> None:
    with pytest.raises(BusUnavailableError) as caught:
        LinuxBus(str(tmp_path / "i2c-1")).transfer(PING)
    for part in ("no other I2C bus exists", "raspi-config", "dtparam=i2c_arm=on"):
        assert part in str(caught.value)


@pytest.mark.parametrize("make", [Path.touch, Path.mkdir])
def test_something_that_is_no_adapter_is_refused(tmp_path: Path, make: object) -> None:
    make(tmp_path / "i2c-1")  # type: ignore[operator]
    with pytest.raises(BusUnavailableError, match="is not an I2C adapter"):
        LinuxBus(str(tmp_path / "i2c-1")).transfer(PING)


HOLDER = """
import fcntl, sys
device = open(sys.argv[1], "w")
fcntl.flock(device, fcntl.LOCK_EX)
print("locked", flush=True)
sys.stdin.read()
"""


@pytest.mark.parametrize("end", ["close", "kill"])
def test_a_bus_that_another_program_uses_is_refused_with_its_name_and_pid(
    tmp_path: Path, end: str
) -> None:
    device, script = tmp_path / "i2c-1", tmp_path / "pipetting.py"
    script.write_text(HOLDER)
    with subprocess.Popen(
        [sys.executable, str(script), str(device)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as other:
        try:
            assert other.stdin
            assert other.stdout
            assert other.stdout.readline() == "locked\n"
            bus = LinuxBus(str(device))
            for _ in range(3):
                with pytest.raises(BusUnavailableError) as caught:
                    bus.transfer(PING)
                used = f"{device} is used by pipetting.py (pid {other.pid}): "
                assert str(caught.value).startswith(used)
                assert str(caught.value).endswith("; end that one first")
            if end == "kill":
                other.kill()
            else:
                other.stdin.close()
            other.wait(10.0)
            with pytest.raises(BusUnavailableError, match="is not an I2C adapter"):
                bus.transfer(PING)
        finally:
            other.kill()


def test_a_second_bus_of_the_same_program_is_named_as_such(tmp_path: Path) -> None:
    device = tmp_path / "i2c-1"
    with device.open("w") as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        with pytest.raises(
            BusUnavailableError, match=f"another bus of this program, .*pid {os.getpid()}"
        ):
            LinuxBus(str(device)).transfer(PING)


def test_making_a_bus_opens_nothing_and_closing_it_is_idempotent() -> None:
    bus = LinuxBus("/nowhere/i2c-1")
    bus.close()
    bus.close()
    with pytest.raises(BusUnavailableError, match="was closed"):
        bus.transfer(PING)


@pytest.mark.parametrize(
    ("transaction", "part"),
    [
        (Transaction(0x07, b"\x0f", 2), "0x7 is outside 0x08 .. 0x77"),
        (Transaction(0x78, b"\x0f", 2), "0x78 is outside"),
        (Transaction(-1, b"\x0f", 2), "is outside"),
        (Transaction(0x11, b"\x0f", -1), "-1 bytes"),
        (Transaction(0x11, b"", 33), "33 bytes is outside 0 .. 32"),
        (Transaction(0x11, bytes(33), 0), "33 bytes is outside 0 .. 32"),
        (Transaction(0x11, bytes(255), 1), "255 bytes is outside 0 .. 32"),
        (Transaction(0x11, b"", 0), "neither written nor read"),
    ],
)
def test_what_no_bus_can_carry_is_refused_before_the_device_is_opened(
    transaction: Transaction, part: str
) -> None:
    with pytest.raises(InvalidArgumentError) as caught:
        LinuxBus("/nowhere/i2c-1").transfer([*PING, transaction])
    assert part in str(caught.value)


@pytest.mark.parametrize("timeout", [0.0, -1.0, 1.1, math.nan, math.inf])
def test_an_impossible_timeout_is_refused(timeout: float) -> None:
    with pytest.raises(LimitError):
        LinuxBus(1, timeout)


@pytest.mark.parametrize(
    ("asked", "got"), [(0.005, 0.01), (0.01, 0.01), (0.011, 0.02), (0.03, 0.03)]
)
def test_the_timeout_is_rounded_up_to_what_the_kernel_counts_in(asked: float, got: float) -> None:
    assert LinuxBus(1, asked).timeout == pytest.approx(got)


def test_a_negative_number_is_refused() -> None:
    with pytest.raises(InvalidArgumentError, match="bus number -1"):
        LinuxBus(-1)
