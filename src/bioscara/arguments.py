"""Conversion and checks of values passed by callers, in one place.

The results are plain types: a ``float``, an ``int``, a ``bool``, an array of float64. Numbers of
Python and of numpy are numbers, also arrays of them without dimensions. Texts, ``Decimal``, truth
values and numbers too large for a float are not. No value from outside enters a control cycle
unchecked: an exception there is a fault of the whole arm.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from numbers import Real
from typing import TYPE_CHECKING, Any

from bioscara.errors import InvalidArgumentError
from bioscara.printing import printable

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

OVERLAY_VARIABLE = "BIOSCARA_PARAMETERS"
"""Environment variable that names the file with the parameters of the user's own arm."""
_SHOWN = 100
"""Characters of a refused value shown in an error."""
_LARGEST_SHOWN = 1 << 128
"""Integers from here on are shown by their size: Python refuses to format the largest ones."""


def shown(value: object) -> str:
    """Return a value as shown in an error: one printable line of limited length."""
    if isinstance(value, int) and not -_LARGEST_SHOWN < value < _LARGEST_SHOWN:
        return f"a whole number of {value.bit_length()} bits"
    try:
        text = " ".join(repr(value).split())
    except Exception:  # noqa: BLE001  no error here may hide the original one
        return f"a {type(value).__name__}"
    if len(text) > _SHOWN:
        text = f"{text[: _SHOWN - 4]} ..."
    return printable(text)


def number(
    what: str,
    value: object,
    *,
    infinite: bool = False,
    error: type[InvalidArgumentError] = InvalidArgumentError,
) -> float:
    """Return a number as a float.

    Args:
        what: Name of the value in the error.
        value: The passed value.
        infinite: Whether an infinity is allowed.
        error: Exception to raise if it cannot be used.

    Raises:
        InvalidArgumentError: It is no number, not a finite one, or too large for a float.
    """
    result = value if type(value) is float else _float_of(what, value, error)
    if not math.isfinite(result) and (math.isnan(result) or not infinite):
        raise error(f"{what} is {result}, which is not a finite number")
    return result


def whole(
    what: str, value: object, *, error: type[InvalidArgumentError] = InvalidArgumentError
) -> int:
    """Return a whole number as an int; arguments and errors as :func:`number`."""
    result = number(what, value, error=error)
    if not result.is_integer():
        raise error(f"{what} is {result:g}, which is not a whole number")
    return int(result)


def flag(
    what: str, value: object, *, error: type[InvalidArgumentError] = InvalidArgumentError
) -> bool:
    """Return a truth value; the text "no" would count as true elsewhere.

    Raises:
        InvalidArgumentError: It is neither True nor False.
    """
    if not isinstance(value, bool):
        raise error(f"{what} is {shown(value)}; give True or False")
    return value


def text(
    what: str, value: object, *, error: type[InvalidArgumentError] = InvalidArgumentError
) -> str:
    """Return a text.

    Raises:
        InvalidArgumentError: It is something else.
    """
    if not isinstance(value, str):
        raise error(f"{what} is {shown(value)}; give a text")
    return value


def function(
    what: str, value: object, *, error: type[InvalidArgumentError] = InvalidArgumentError
) -> None:
    """Raise unless a value can be called.

    Raises:
        InvalidArgumentError: It cannot.
    """
    if not callable(value):
        raise error(f"{what} is {shown(value)}; give a function")


def items(
    what: str,
    values: object,
    remedy: str = "give a list",
    *,
    error: type[InvalidArgumentError] = InvalidArgumentError,
) -> tuple[Any, ...]:
    """Return an ordered collection as a tuple: a sequence, or an array of one dimension.

    Args:
        what: Name of the values in the error.
        values: The passed values.
        remedy: The value to pass instead.
        error: Exception to raise if they cannot be used.

    Raises:
        InvalidArgumentError: It is something else, such as a text, a set or a single number.
    """
    if type(values) is list:
        return tuple(values)
    ordered = isinstance(values, Sequence) and not isinstance(values, str | bytes | bytearray)
    if not ordered and getattr(values, "ndim", None) != 1:
        raise error(f"{what} are {shown(values)}; {remedy}")
    return tuple(values)  # type: ignore[arg-type]


def numbers(
    what: str,
    values: object,
    remedy: str = "give a list of numbers",
    *,
    error: type[InvalidArgumentError] = InvalidArgumentError,
) -> tuple[float, ...]:
    """Return several numbers as floats; arguments and errors as above."""
    given = items(what, values, remedy, error=error)
    if all(type(value) is float for value in given) and math.isfinite(math.fsum(given)):
        return given  # a trajectory has very many
    return tuple(
        number(f"{what}, value {index}", value, error=error) for index, value in enumerate(given)
    )


def array(
    what: str, values: object, *, error: type[InvalidArgumentError] = InvalidArgumentError
) -> npt.NDArray[np.float64]:
    """Return numbers as a new array; they may be infinite or NaN, which is left to the caller.

    Raises:
        InvalidArgumentError: Something in it is no number, or the rows differ in length.
    """
    import numpy as np  # noqa: PLC0415  drivers need no arrays

    try:
        found = np.array(values)
    except Exception as reason:
        raise error(f"{what}: rows do not all have the same size, or hold no numbers") from reason
    if found.dtype.kind not in "iuf":
        # Without an explicit type, numpy would accept texts and None as numbers.
        raise error(f"{what}: {shown(values)} has something that is no number, or is too large")
    with np.errstate(over="ignore"):
        return found.astype(np.float64)


def _float_of(what: str, value: object, error: type[InvalidArgumentError]) -> float:
    kind = getattr(getattr(value, "dtype", None), "kind", "")
    scalar = isinstance(value, Real) or (getattr(value, "shape", None) == () and kind in "iuf")
    if isinstance(value, bool) or not scalar:
        raise error(f"{what} is {shown(value)}; give a number")
    try:
        return float(value)  # type: ignore[arg-type]
    except OverflowError:
        raise error(f"{what} is {shown(value)}: too large") from None
    except Exception as reason:
        raise error(f"{what} is {shown(value)}; give a number") from reason
