"""Messages of an owner as JSON, in which a number that is unknown is null."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import msgspec
from msgspec import inspect

from bioscara.api.messages import FromOwner

_Fill = Callable[[Any], Any]
"""Returns a decoded value with NaN for each null that stands for a number; may change it."""

_MAPPINGS = inspect.DictType | inspect.StructType | inspect.DataclassType

_typed: msgspec.json.Decoder[Any] = msgspec.json.Decoder(FromOwner)


def decode(payload: bytes) -> FromOwner:
    """Return the message of an owner that is encoded as JSON.

    Raises:
        msgspec.DecodeError: It is none.
    """
    try:
        message: FromOwner = _typed.decode(payload)
    except msgspec.ValidationError:
        if b"null" not in payload:
            raise
        value = msgspec.json.decode(payload)
        filled = value if _fill is None else _fill(value)
        message = msgspec.convert(filled, FromOwner, str_keys=True)
    return message


def _filler(kind: inspect.Type) -> _Fill | None:
    """Return what fills values of a type; None if they have no numbers of which one may be null."""
    found: _Fill | None = None
    match kind:
        case inspect.Metadata():
            found = _filler(kind.type)
        case inspect.FloatType():
            found = _number
        case inspect.UnionType():
            found = _of_union(kind)
        case inspect.StructType() | inspect.DataclassType():
            found = _of_fields({field.encode_name: _filler(field.type) for field in kind.fields})
        case inspect.NamedTupleType():
            found = _of_items([_filler(field.type) for field in kind.fields])
        case inspect.TupleType():
            found = _of_items([_filler(each) for each in kind.item_types])
        case inspect.VarTupleType() | inspect.ListType():
            found = _of_each(_filler(kind.item_type))
        case inspect.DictType():
            found = _of_values(_filler(kind.value_type))
    return found


def _number(value: Any) -> Any:
    return math.nan if value is None else value


def _of_union(kind: inspect.UnionType) -> _Fill | None:
    structs: dict[object, _Fill | None] = {}
    others: dict[type, _Fill] = {}
    for each in kind.types:
        found = _filler(each)
        if isinstance(each, inspect.StructType) and each.tag is not None:
            structs[each.tag] = found
        elif found is not None:
            mapping = isinstance(each, _MAPPINGS)
            number = isinstance(each, inspect.FloatType)
            others[float if number else dict if mapping else list] = found
    optional = any(isinstance(each, inspect.NoneType) for each in kind.types)
    if not (structs or others):
        return None

    def fill(value: Any) -> Any:
        if value is None:
            return math.nan if float in others and not optional else None
        of_struct = isinstance(value, dict) and structs
        chosen = structs.get(value.get("kind")) if of_struct else others.get(type(value))
        return value if chosen is None else chosen(value)

    return fill


def _of_fields(fills: dict[str, _Fill | None]) -> _Fill | None:
    wanted = [(name, fill) for name, fill in fills.items() if fill is not None]

    def fill_fields(value: Any) -> Any:
        if isinstance(value, dict):
            for name, fill in wanted:
                if name in value:
                    value[name] = fill(value[name])
        return value

    return fill_fields if wanted else None


def _of_items(fills: list[_Fill | None]) -> _Fill | None:
    def fill_items(value: Any) -> Any:
        if isinstance(value, list):
            # A tuple with defaults may be shorter.
            for index, fill in enumerate(fills[: len(value)]):
                if fill is not None:
                    value[index] = fill(value[index])
        return value

    return fill_items if any(fills) else None


def _of_each(fill: _Fill | None) -> _Fill | None:
    if fill is None:
        return None
    return lambda value: [*map(fill, value)] if isinstance(value, list) else value


def _of_values(fill: _Fill | None) -> _Fill | None:
    if fill is None:
        return None

    def fill_values(value: Any) -> Any:
        if isinstance(value, dict):
            return {name: fill(each) for name, each in value.items()}
        return value

    return fill_values


_fill = _filler(inspect.type_info(FromOwner))
