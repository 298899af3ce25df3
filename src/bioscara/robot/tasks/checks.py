"""Checks of the values of a task, declared in the type of each field.

msgspec compares ranges only where it reads a message, and reports the first problem alone. Here the
check is in the metadata of the field, so that a program, a message and a step of a sequence get the
same sentence; range and unit are also in the JSON Schema.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, get_args

import msgspec
from msgspec import Meta

from bioscara.arguments import number
from bioscara.errors import LimitError

Check = Callable[[str, Any], object]
"""Returns a value as the task keeps it, for the name of its field; raises an InvalidArgumentError
if it cannot be used."""

_CHECK, _FORM = "check", "form"


def checked_by(check: Check, form: type[Any] | None = None, **schema: Any) -> Meta:
    """Return the metadata of a field.

    Args:
        check: Its check.
        form: How its value is written in a file, where that differs: see :mod:`.forms`.
        schema: Content of the JSON Schema without the type.
    """
    return Meta(extra={_CHECK: check, _FORM: form}, extra_json_schema=schema or None)


def within(lower: float, upper: float, unit: str, remedy: str = "") -> Meta:
    """Return the metadata of a number.

    Args:
        lower: Smallest value.
        upper: Largest value.
        unit: Its unit.
        remedy: What to give instead, for the message.
    """

    def check(name: str, value: object) -> float:
        given = number(name, value)
        if not lower <= given <= upper:
            raise LimitError(name, given, lower, upper, unit, remedy)
        return given

    unit_of: dict[str, Any] = {"x-unit": unit}
    return checked_by(check, minimum=lower, maximum=upper, **unit_of)


def check_fields(value: msgspec.Struct) -> None:
    """Check the fields of a struct, and keep the values that the checks return.

    Raises:
        InvalidArgumentError: A value cannot be used; the message names the field.
    """
    for name, check in _checks(type(value)):
        given = getattr(value, name)
        if given is None:
            continue
        if (kept := check(name, given)) is not given:
            msgspec.structs.force_setattr(value, name, kept)


@cache
def _checks(kind: type[msgspec.Struct]) -> tuple[tuple[str, Check], ...]:
    found = ((each.name, metadata(each.type)) for each in msgspec.structs.fields(kind))
    return tuple((name, extra[_CHECK]) for name, extra in found if extra)


def metadata(kind: Any) -> dict[str, Any]:
    """Return the check and the form of the type of a field; empty if it has none."""
    for meta in getattr(kind, "__metadata__", ()):
        if isinstance(meta, Meta) and meta.extra is not None:
            return meta.extra
    # Those of a value that may be left out are within the union with None.
    if type(None) in get_args(kind):
        for inner in get_args(kind):
            if extra := metadata(inner):
                return extra
    return {}
