"""The Linux bus against the kernel's rules: its settings, its messages, and each errno."""

from __future__ import annotations

import errno
from collections.abc import Callable
from pathlib import Path

import pytest

from bioscara.bus import Transaction
from bioscara.bus.linux import STUCK_AFTER
from bioscara.errors import (
    BusStuckError,
    BusTimeoutError,
    BusUnavailableError,
    CommunicationError,
    NoAcknowledgeError,
)
from contract.preload import PreloadedBus, build_shim

ADDRESSES = (0x11, 0x12, 0x13, 0x14)
PING = [Transaction(address, b"\x0f", 2) for address in ADDRESSES]
ALL = len(PING)
OFFSET = [Transaction(address, b"\x2e", 5) for address in ADDRESSES]
BARE = [Transaction(0x11, b"\x0f", 0), Transaction(0x11, b"", 2)]

OpenLinux = Callable[..., PreloadedBus]


def kinds(results: list[bytes | CommunicationError]) -> list[type]:
    return [type(result) for result in results]


@pytest.fixture
def bus(open_linux: OpenLinux) -> PreloadedBus:
    return open_linux()


@pytest.mark.parametrize("rules", ["", "pi4", "pi5"])
def test_every_ioctl_carries_one_write_and_one_read_at_most(
    open_linux: OpenLinux, rules: str
) -> None:
    bus = open_linux(rules)
    assert kinds(bus.transfer(PING + BARE)) == [bytes] * 4 + [bytes, bytes]
    assert bus.shim("shim_transfers") == 6
    assert bus.shim("shim_most_messages") == 2


@pytest.mark.parametrize("rules", ["", "pi4", "pi5"])
def test_smbus2_gets_the_same_bytes(open_linux: OpenLinux, rules: str) -> None:
    bus = open_linux(rules)
    for transactions in (PING, OFFSET):
        theirs = [bus.smbus2([transaction]) for transaction in transactions]
        assert [[result] for result in bus.transfer(transactions)] == theirs


@pytest.mark.parametrize(
    ("rules", "messages", "expected"),
    [
        ("", PING, None),
        ("pi4", PING, errno.EOPNOTSUPP),
        ("pi5", PING, errno.EINVAL),
        ("pi4", [*BARE, *BARE], errno.EOPNOTSUPP),
        ("", [BARE[0]] * 42, None),
        ("", [BARE[0]] * 43, errno.EINVAL),
        ("", [Transaction(0x20, b"\x0f", 2)], errno.EREMOTEIO),
    ],
)
def test_the_pretended_kernel_refuses_what_the_real_ones_refuse(
    open_linux: OpenLinux, rules: str, messages: list[Transaction], expected: int | None
) -> None:
    result = open_linux(rules).smbus2(messages)
    assert result == expected if expected is not None else isinstance(result, list)


def test_the_device_is_opened_at_the_first_transfer_and_only_once(bus: PreloadedBus) -> None:
    assert bus.shim("shim_opens") == 0
    for _ in range(3):
        bus.transfer(PING)
    assert bus.shim("shim_opens") == 1


def test_timeout_and_retries_of_the_adapter_are_set(bus: PreloadedBus) -> None:
    bus.transfer(PING)
    assert bus.shim("shim_timeout") == 1
    assert bus.shim("shim_retries") == 0


@pytest.mark.parametrize(
    ("code", "kind"),
    [
        (errno.EREMOTEIO, NoAcknowledgeError),
        (errno.ENXIO, NoAcknowledgeError),
        (errno.ETIMEDOUT, BusTimeoutError),
        (errno.EAGAIN, BusTimeoutError),
        (errno.EBUSY, BusTimeoutError),
        (errno.EIO, BusTimeoutError),
        (errno.EOPNOTSUPP, CommunicationError),
        (errno.EINVAL, CommunicationError),
        (errno.EPROTO, CommunicationError),
        (errno.ENODEV, BusUnavailableError),
    ],
)
def test_each_errno_becomes_the_error_of_its_transaction_and_is_not_retried(
    bus: PreloadedBus, code: int, kind: type[CommunicationError]
) -> None:
    bus.shim("shim_fail", code, 1)
    first, *others = bus.transfer(PING)
    assert type(first) is kind
    assert first.address == 0x11
    for part in ("/dev/i2c-1", "0x11", errno.errorcode[code]):
        assert part in str(first)
    assert kinds(others) == [bytes] * 3
    assert bus.shim("shim_transfers") == ALL
    assert sum(bus.statistics()) == 1


def test_an_adapter_that_vanished_is_opened_anew(bus: PreloadedBus) -> None:
    bus.shim("shim_fail", errno.ENODEV, ALL)
    assert kinds(bus.transfer(PING)) == [BusUnavailableError] * ALL
    assert kinds(bus.transfer(PING)) == [bytes] * ALL
    assert bus.shim("shim_opens") == 2


@pytest.mark.parametrize(
    ("code", "part"),
    [
        (errno.EACCES, "sudo usermod -aG i2c"),
        (errno.EPERM, "sudo usermod -aG i2c"),
        (errno.ENODEV, "has no adapter behind it"),
        (errno.ENOENT, "dtparam=i2c_arm=on"),
        (errno.EMFILE, "Too many open files"),
    ],
)
def test_a_device_that_cannot_be_opened_names_the_remedy(
    bus: PreloadedBus, code: int, part: str
) -> None:
    bus.shim("shim_fail_open", code)
    with pytest.raises(BusUnavailableError) as caught:
        bus.transfer(PING)
    assert str(caught.value).startswith("/dev/i2c-1 ")
    assert part in str(caught.value)
    assert bus.shim("shim_transfers") == 0
    bus.shim("shim_fail_open", 0)
    assert kinds(bus.transfer(PING)) == [bytes] * ALL


def test_an_adapter_without_plain_i2c_is_refused(bus: PreloadedBus) -> None:
    bus.shim("shim_functions", 0x0EFF0008)
    with pytest.raises(BusUnavailableError, match="SMBus commands only"):
        bus.transfer(PING)


def test_a_stuck_bus_is_reopened_and_costs_one_timeout_per_transfer(bus: PreloadedBus) -> None:
    bus.shim("shim_fail", errno.ETIMEDOUT, STUCK_AFTER + 2)
    assert kinds(bus.transfer(PING)) == [BusTimeoutError] * ALL
    for reopened in (1, 2):
        results = bus.transfer(PING)
        assert kinds(results) == [BusStuckError] * ALL
        assert [getattr(result, "address", None) for result in results] == list(ADDRESSES)
        assert "holds a line low" in str(results[0])
        assert bus.shim("shim_transfers") == STUCK_AFTER + reopened
        assert bus.shim("shim_opens") == 1 + reopened
    assert kinds(bus.transfer(PING)) == [bytes] * ALL
    assert bus.statistics() == (0, STUCK_AFTER + 2, 0, 3)
    bus.transfer(PING)
    assert bus.shim("shim_opens") == 4


def test_a_bus_that_answers_at_all_is_not_stuck(bus: PreloadedBus) -> None:
    for _ in range(3):
        bus.shim("shim_fail", errno.ETIMEDOUT, 3)
        assert kinds(bus.transfer(PING)) == [BusTimeoutError] * 3 + [bytes]
    for code in (errno.ETIMEDOUT, errno.EREMOTEIO) * 4:
        bus.shim("shim_fail", code, 1)
        bus.transfer(PING[:1])
    assert bus.shim("shim_opens") == 1


def test_timeouts_of_one_address_alone_do_not_make_the_bus_stuck(bus: PreloadedBus) -> None:
    bus.shim("shim_fail", errno.ETIMEDOUT, 2 * STUCK_AFTER)
    for _ in range(2 * STUCK_AFTER):
        assert kinds(bus.transfer(PING[:1])) == [BusTimeoutError]
    assert bus.shim("shim_opens") == 1
    assert kinds(bus.transfer(PING)) == [bytes] * ALL


def test_a_stuck_adapter_that_vanishes_is_unavailable(bus: PreloadedBus) -> None:
    bus.shim("shim_fail", errno.ETIMEDOUT, ALL)
    bus.transfer(PING)
    bus.shim("shim_fail", errno.ENODEV, 1)
    assert kinds(bus.transfer(PING)) == [BusUnavailableError] * ALL
    assert kinds(bus.transfer(PING)) == [bytes] * ALL


def test_a_stuck_adapter_that_cannot_be_opened_any_more_says_so(bus: PreloadedBus) -> None:
    bus.shim("shim_fail", errno.ETIMEDOUT, ALL)
    bus.transfer(PING)
    bus.shim("shim_fail_open", errno.ENOENT)
    with pytest.raises(BusUnavailableError, match="does not exist"):
        bus.transfer(PING)


def test_without_a_compiler_the_missing_package_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(RuntimeError, match="need a C compiler"):
        build_shim(tmp_path)
