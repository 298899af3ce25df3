"""Values that no call can use, for every parameter of every call."""

from __future__ import annotations

import dataclasses
import itertools
import math
import os
import zlib
from collections.abc import Callable, Iterator
from decimal import Decimal
from enum import Enum
from fractions import Fraction
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from bioscara.errors import BioscaraError, MotionTimeoutError
from bioscara.model import ArmParameters

SHARE = int(os.environ.get("BIOSCARA_VALUES_SHARE", "3"))
"""Of how many values one is tried for a parameter, another for each; ``make laws`` tries all."""


class Hostile:
    """Raises on every operation."""

    def _raise(self, *_: object) -> NoReturn:
        raise RuntimeError("hostile")

    __float__ = __int__ = __index__ = __len__ = __iter__ = __eq__ = __hash__ = _raise
    __lt__ = __gt__ = __le__ = __ge__ = __repr__ = __bool__ = __array__ = _raise


class Colour(Enum):
    RED = 1


VALUES: tuple[Any, ...] = (
    None, True, False, Ellipsis, NotImplemented, object(), Hostile(), Colour.RED, Path("x"),
    math.nan, math.inf, -math.inf, 1e308, -1e308, 5e-324, -0.0, 0, -1, 3, 0.3,
    10**400, -(10**400), 10**5000, Fraction(3, 10), Decimal("0.3"), Decimal("NaN"),
    Decimal(10**400), 1j, "", "0.3", "fast", "\x1b[31m\n", "x" * 100_000, b"0.3", bytearray(b"x"),
    np.float32(0.3), np.float16(0.3), np.float64("nan"), np.longdouble("1e4000"), np.int64(1),
    np.uint8(1), np.bool_(True), np.array(0.3), np.array(1), np.array("x"), np.array(None),
    np.array([0.3]), np.array([]), np.array([[0.3]]), np.ma.masked, np.datetime64("2026-01-01"),
    [], (), {}, set(), [0.3], (0.3,) * 4, [None] * 4, ["a"] * 4, [math.nan] * 4, [10**400] * 4,
    {"j1": 0.3}, {0.1, 0.2, 0.3, 0.4}, range(4), iter(()), [[0.3]] * 4, [Hostile()] * 4,
)  # fmt: skip


PARTS: tuple[Any, ...] = (
    None, True, "0.3", Hostile(), math.nan, -math.inf, 1e308, 10**400, 10**5000, Decimal("0.3"), 1j,
    [], (0.3, 0.3), np.array([0.3]), np.float64("nan"), np.longdouble("1e4000"), np.bool_(True),
)  # fmt: skip
"""Replacements for a part: only values that are not numbers, so that nothing moves far."""


class Parts(tuple[Any, ...]):
    """A usable value of which only the parts are replaced."""

    __slots__ = ()


@dataclasses.dataclass
class Replaced:
    """A dataclass with one value replaced, which may refuse that when it is made."""

    base: Any
    field: str
    value: object

    def __call__(self) -> object:
        return dataclasses.replace(self.base, **{self.field: self.value})


def mutants(base: object) -> Iterator[object]:
    """Return all values, and the base with each of its parts replaced or as numpy has it."""
    if not isinstance(base, Parts):
        yield from VALUES
    if isinstance(base, ArmParameters):
        return  # its parts are checked where its file is read
    parts: Any = base
    if isinstance(base, list | tuple):
        parts = dict(enumerate(base))
    elif dataclasses.is_dataclass(base):
        fields = dataclasses.fields(base)
        parts = {field.name: getattr(base, field.name) for field in fields if field.init}
    elif not isinstance(base, dict):
        return
    for key, part in parts.items():
        plain = isinstance(part, float)
        for value in (*PARTS, np.float32(part), np.array(part)) if plain else PARTS:
            if dataclasses.is_dataclass(base):
                yield Replaced(base, key, value)
            elif isinstance(base, dict):
                yield {**base, key: value}
            elif hasattr(base, "_replace"):
                yield type(base)(*[*base[:key], value, *base[key + 1 :]])
            else:
                yield type(base)([*base[:key], value, *base[key + 1 :]])


def judge(
    name: str,
    call: Callable[..., object],
    base: dict[str, Any],
    after: Callable[[bool], str] = lambda _: "",
    *,
    share: int = SHARE,
) -> list[str]:
    """Return violations of the law that a call takes a value or refuses it with its own error.

    Args:
        name: Name of the call.
        call: Called with the base, in which one value is replaced.
        base: Arguments that it can use.
        after: Called with whether it was refused; returns the fault of the arm afterwards, if any.
        share: Of how many values one is tried.
    """
    complaints = []
    for parameter, usable in base.items():
        first = zlib.crc32(f"{name}({parameter})".encode()) % share
        for value in itertools.islice(mutants(usable), first, None, share):
            what, refused, last = f"{name}({parameter}={_shown(value)})", False, ""
            try:
                made = value() if isinstance(value, Replaced) else value
                call(**{**base, parameter: made})
            except BioscaraError as error:
                # A motion that takes longer than it may has begun.
                refused = not isinstance(error, MotionTimeoutError)
                last = f"{type(error).__name__}: {error}"
                text = str(error)
                if len(text) > 2000 or not text.isprintable():
                    complaints.append(f"{what}: {len(text)} characters: {text[:80]!r}")
            except Exception as error:  # noqa: BLE001  that is the complaint
                trace = error.__traceback__
                while trace is not None:
                    code = trace.tb_frame.f_code
                    if "bioscara" in code.co_filename:
                        last = f"{Path(code.co_filename).name}:{trace.tb_lineno}"
                    trace = trace.tb_next
                complaints.append(f"{what}: {type(error).__name__}: {error} at {last}"[:300])
            if wrong := after(refused):
                complaints.append(f"{what}: {wrong} ({last})")
    return complaints


def _shown(value: object) -> str:
    try:
        return repr(value)[:60]
    except Exception:  # noqa: BLE001  hostile
        return f"<{type(value).__name__}>"
