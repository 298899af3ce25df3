"""Errors as values, and back as exceptions of the same class with the same data."""

from __future__ import annotations

import math
from typing import Any

from bioscara import errors
from bioscara.api.messages import FailureValue
from bioscara.errors import BioscaraError, OwnerError
from bioscara.printing import brief, shortened

_SIMPLE = (str, int, float, bool, type(None))
_SMALLEST, _LARGEST = -(1 << 63), (1 << 64) - 1
"""Range of the whole numbers that can be sent."""
_FAILURE = "_failure"
"""Key that marks an error within the data of another one."""


def failure_of(error: BaseException) -> FailureValue:
    """Return an error as a value.

    An error that is none of the package's has its text alone: its data may be anything.
    """
    name, code = type(error).__name__, getattr(error, "code", BioscaraError.code)
    if isinstance(error, BioscaraError) and _class_of(name) is type(error):
        data = {
            key: _simple(value)
            for key, value in vars(error).items()
            if isinstance(value, (BaseException, *_SIMPLE))
        }
        data["args"] = [_simple(value) for value in error.args if isinstance(value, _SIMPLE)]
        return FailureValue(name, code, str(error), data)
    if isinstance(error, OSError):
        data = {"errno": error.errno, "strerror": error.strerror, "filename": None}
        if isinstance(error.filename, str):
            data["filename"] = _simple(error.filename)
        return FailureValue("OSError", BioscaraError.code, brief(str(error)), data)
    return FailureValue(name, BioscaraError.code, brief(str(error)))


def error_of(failure: FailureValue) -> Exception:
    """Return the exception of a value; an OwnerError for a class that is not known here."""
    data = dict(failure.data)
    if failure.error == "OSError":
        if data.get("errno") is None:
            return OSError(failure.text)
        return OSError(data["errno"], data.get("strerror"), data.get("filename"))
    kind = _class_of(failure.error)
    if kind is None:
        return OwnerError(f"{failure.error}: {failure.text}")
    # Without its constructor: the arguments of that are not among the attributes.
    error = kind.__new__(kind)
    error.args = tuple(data.pop("args", (failure.text,)))
    for key, value in data.items():
        if isinstance(value, dict) and _FAILURE in value:
            value = error_of(FailureValue(**value[_FAILURE]))  # noqa: PLW2901
        setattr(error, key, value)
    return error


def _class_of(name: str) -> type[BioscaraError] | None:
    kind = getattr(errors, name, None)
    return kind if isinstance(kind, type) and issubclass(kind, BioscaraError) else None


def _simple(value: object) -> Any:
    if isinstance(value, BaseException):
        inner = failure_of(value)
        fields = {key: getattr(inner, key) for key in inner.__struct_fields__}
        return {_FAILURE: fields}
    if isinstance(value, str):
        # The name of a file may have bytes that are no Unicode, which cannot be sent; and events
        # and goals are kept, so a name of any length is shortened.
        return shortened(value).encode(errors="backslashreplace").decode()
    if isinstance(value, int) and not _SMALLEST <= value <= _LARGEST:
        return math.inf if value > 0 else -math.inf
    return value
