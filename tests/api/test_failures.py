"""Errors of an owner, raised again at its client."""

from __future__ import annotations

import errno
import inspect
import math
from typing import Any

import msgspec
import pytest

from bioscara import errors
from bioscara.api import framing, messages as m
from bioscara.api.failures import error_of, failure_of
from bioscara.errors import (
    BioscaraError,
    BusyError,
    CommunicationError,
    JointLostError,
    LimitError,
    OwnerError,
    PathError,
    ReplayError,
    ZoneError,
)
from entries import entry

CLASSES = [
    kind
    for name, kind in vars(errors).items()
    if isinstance(kind, type) and issubclass(kind, BioscaraError) and not name.startswith("_")
]
SAMPLES: dict[type[Any], tuple[Any, ...]] = {
    PathError: ("the wrist cannot follow", 2, "j3", 0.25, 0.1),
    ZoneError: ("rack", "link_3", 1.5, 0.01, 0.005, "after 1.5 s"),
    ReplayError: ("another transaction", 17),
    BusyError: ("home()", "move_to()", 1.25, "MainThread", False),
    JointLostError: ("j2 is lost", 0x12, "j2", 3, CommunicationError("no answer", 0x12)),
}


def sample(kind: type[BioscaraError]) -> BioscaraError:
    """Return an error with data in each of its arguments."""
    if kind in SAMPLES:
        return kind(*SAMPLES[kind])
    if issubclass(kind, LimitError):
        return kind("j2 velocity", 3.5, -1.0, 1.0, "rad/s", "move slower")
    given: list[Any] = ["what happened"]
    for parameter in list(inspect.signature(kind.__init__).parameters.values())[2:]:
        if parameter.kind is parameter.VAR_POSITIONAL or parameter.kind is parameter.VAR_KEYWORD:
            continue
        given.append({"str": f"the {parameter.name}"}.get(str(parameter.annotation), 3))
    return kind(*given)


def sent(error: BaseException) -> Exception:
    """Return an error as it arrives at a client, by either form of messages."""
    refused = m.RequestFailed(1, failure_of(error))
    packed = framing.from_owner.decode(framing.encode_packed(refused))
    assert isinstance(packed, m.RequestFailed)
    as_json = msgspec.json.decode(framing.encode_json(refused), type=m.RequestFailed)
    assert as_json == packed or "nan" in repr(packed)
    return error_of(packed.failure)


def test_an_error_arrives_with_its_class_text_and_data() -> None:
    for kind in CLASSES:
        with entry(kind):
            error = sample(kind)
            back = sent(error)
            assert type(back) is kind
            assert str(back) == str(error)
            assert back.args == error.args
            assert back.code == error.code
            assert set(vars(back)) == set(vars(error))
            for name, value in vars(error).items():
                arrived = getattr(back, name)
                if isinstance(value, BaseException):
                    assert type(arrived) is type(value)
                    assert (str(arrived), vars(arrived)) == (str(value), vars(value))
                else:
                    assert arrived == value, name


def test_errors_of_the_system_arrive_with_their_number() -> None:
    back = sent(OSError(errno.ENOSPC, "No space left on device", "/tmp/x"))
    assert isinstance(back, OSError)
    assert (back.errno, back.filename) == (errno.ENOSPC, "/tmp/x")
    assert isinstance(sent(FileNotFoundError(errno.ENOENT, "gone", "x")), FileNotFoundError)
    assert str(sent(OSError("without a number"))) == "without a number"


def test_other_errors_arrive_as_an_error_of_the_owner() -> None:
    for error in (
        ZeroDivisionError("by zero"),
        KeyboardInterrupt(),
        type("Own", (Exception,), {})("x"),
    ):
        back = sent(error)
        assert type(back) is OwnerError
        assert type(error).__name__ in str(back)
    unknown = m.FailureValue("ErrorOfTomorrow", -999, "not known here")
    assert str(error_of(unknown)) == "ErrorOfTomorrow: not known here"
    assert type(error_of(m.FailureValue("printable", 1, "no class"))) is OwnerError


def test_data_that_cannot_be_sent_costs_only_itself() -> None:
    error = LimitError("x", 10**40, -math.inf, math.nan, "", "y")
    back = sent(error)
    assert isinstance(back, LimitError)
    assert back.value == math.inf
    assert math.isnan(back.upper)
    broken = OSError(errno.ENOENT, "gone", "name \udcff")
    assert "\\udcff" in str(sent(broken))
    noted = LimitError("x", 1.0, 0.0, 0.5, "m")
    noted.add_note("of the planner")
    noted.extra = object()  # type: ignore[attr-defined]
    assert str(sent(noted)) == str(noted)


def test_numbers_of_numpy_in_errors_arrive() -> None:
    np = pytest.importorskip("numpy")
    error = ZoneError("rack", "link_3", np.float64(1.5), np.float64(0.01), 0.005, "then")
    back = sent(error)
    assert isinstance(back, ZoneError)
    assert back.time == 1.5
