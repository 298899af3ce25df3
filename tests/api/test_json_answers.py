"""Messages of an owner that come as JSON are those that come as msgpack."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import pytest
from msgspec import inspect

from bioscara.api import framing, json_answers, messages as m

_BUILT: dict[type[inspect.Type], Any] = {
    inspect.NoneType: None,
    inspect.BoolType: True,
    inspect.IntType: 1,
    inspect.FloatType: math.nan,
    inspect.StrType: "x",
    inspect.BytesType: b"x",
    inspect.AnyType: None,
}


def made(kind: inspect.Type, *, absent: bool) -> Any:  # noqa: PLR0911  one for each type
    """Return a value of a type as built-in ones, with NaN for each number.

    Args:
        kind: The type.
        absent: Whether optional values are null.
    """
    match kind:
        case inspect.Metadata():
            return made(kind.type, absent=absent)
        case inspect.UnionType():
            others = [each for each in kind.types if not isinstance(each, inspect.NoneType)]
            return None if absent and kind.includes_none else made(others[0], absent=absent)
        case inspect.StructType() | inspect.DataclassType():
            fields = {each.encode_name: made(each.type, absent=absent) for each in kind.fields}
            tag = getattr(kind, "tag", None)
            return fields if tag is None else {"kind": tag, **fields}
        case inspect.NamedTupleType():
            return [made(each.type, absent=absent) for each in kind.fields]
        case inspect.TupleType():
            return [made(each, absent=absent) for each in kind.item_types]
        case inspect.VarTupleType() | inspect.ListType():
            return [made(kind.item_type, absent=absent)] * 2
        case inspect.DictType():
            return {made(kind.key_type, absent=absent): made(kind.value_type, absent=absent)}
        case inspect.LiteralType():
            return kind.values[0]
        case inspect.EnumType():
            return next(iter(kind.cls)).value
    return _BUILT[type(kind)]


def alternatives() -> list[inspect.StructType]:
    """Return the messages of an owner; of a response one with each result."""
    return list(inspect.type_info(m.FromOwner).types)  # type: ignore[attr-defined]


RESULTS = list(inspect.type_info(m.AnyResult).types)  # type: ignore[attr-defined]


def packed(message: object) -> bytes:
    return framing.encode_packed(message)


@pytest.mark.parametrize("absent", [False, True])
def test_a_message_is_the_same_in_both_forms_if_its_numbers_are_unknown(absent: bool) -> None:
    tried = 0
    values = [made(kind, absent=absent) for kind in alternatives()]
    values += [
        {"kind": "response", "id": 1, "result": made(kind, absent=absent)} for kind in RESULTS
    ]
    for value in values:
        try:
            message = framing.from_owner.decode(msgspec.msgpack.encode(value))
        except msgspec.ValidationError:
            # Values that a robot uses refuse unknown numbers: they never have them.
            continue
        assert packed(json_answers.decode(framing.encode_json(message))) == packed(message)
        tried += 1
    assert tried > len(RESULTS) // 2


def test_what_is_no_message_is_refused() -> None:
    for payload in (b"", b"{", b"null", b'{"kind":"absent"}', b'{"kind":"welcome","owner":null}'):
        with pytest.raises(msgspec.DecodeError):
            json_answers.decode(payload)
