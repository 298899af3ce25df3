"""Schemas of pydantic for groups of values, and our sentences for its errors."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import MISSING, Field, fields
from functools import cache, partial
from typing import Any, get_type_hints

from pydantic import GetCoreSchemaHandler, TypeAdapter, ValidationError
from pydantic_core import (
    ArgsKwargs,
    CoreSchema,
    ErrorDetails,
    InitErrorDetails,
    PydanticCustomError,
    core_schema,
)

from bioscara.errors import ConfigurationError
from bioscara.model.validation import (
    KNOWN_AS,
    Checked,
    Location,
    Problem,
    described,
    dotted,
    is_number,
)
from bioscara.spelling import did_you_mean

_MOST = 5
"""Errors that one message names."""
_OTHERS, _DEPTH = "others", "depth"
"""Keys of an error's context: fields of its :class:`Problem`, the length of its location."""


def checked(
    kind: Any,
    values: object,
    place: Callable[[Location], str],
    name: Callable[[Location], str],
    *,
    contradicted: bool = False,
) -> Any:
    """Return the group of these values; arguments and errors as :meth:`Checked.checked`."""
    try:
        return parsed(kind, values)
    except ValidationError as error:
        raise _refusal(error, place, name, contradicted=contradicted) from error


def called(kind: type[Checked], values: Mapping[str, object]) -> Any:
    """Return the group that a call with these values makes; errors as :meth:`Checked.checked`."""
    return checked(kind, ArgsKwargs((), dict(values)), lambda _: f"{kind.__name__}: ", dotted)


def parsed(kind: Any, values: object) -> Any:
    """Return the value of a type.

    Args:
        kind: The type, such as a group.
        values: Its values.

    Raises:
        ValidationError: They cannot be used.
    """
    return _adapter(kind).validate_python(values)


@cache
def _adapter(kind: Any) -> TypeAdapter[Any]:
    return TypeAdapter(kind)


def group(kind: type[Checked], handler: GetCoreSchemaHandler) -> CoreSchema:
    """Return the schema of a group.

    Args:
        kind: The group.
        handler: Returns the schemas of its fields.
    """
    hints, own = get_type_hints(kind, include_extras=True), fields(kind)
    arguments = core_schema.dataclass_args_schema(
        kind.__name__,
        [
            core_schema.dataclass_field(
                each.name, _optional(each, handler.generate_schema(hints[each.name])), kw_only=True
            )
            for each in own
        ],
    )
    made = core_schema.dataclass_schema(kind, arguments, [each.name for each in own])
    return core_schema.no_info_after_validator_function(
        _check_several, before(partial(_by_field, kind), made)
    )


def before(function: Callable[[Any], object], schema: CoreSchema) -> CoreSchema:
    """Return the schema of a value that a function checks or changes before ``schema`` does."""
    return core_schema.no_info_before_validator_function(function, schema)


def _optional(each: Field[Any], schema: CoreSchema) -> CoreSchema:
    if each.default is not MISSING:
        return core_schema.with_default_schema(schema, default=each.default)
    if each.default_factory is not MISSING:
        return core_schema.with_default_schema(schema, default_factory=each.default_factory)
    return schema


def _by_field(kind: type[Checked], values: object) -> object:
    """Refuse unknown names before all else: a misspelt value would be missing, too."""
    if isinstance(values, Mapping):
        values = given = dict(kind.arranged(values))
    elif isinstance(values, ArgsKwargs):
        given = values.kwargs or {}
    else:
        return values
    known = {each.name: each.metadata.get(KNOWN_AS, each.name) for each in fields(kind)}
    unknown = [key for key in given if key not in known][:_MOST]
    listed = f"known here: {', '.join(known.values())}"
    require_none(
        Problem(
            f"is not a known parameter; {did_you_mean(str(key), known, listed)}",
            (key if isinstance(key, str | int) else str(key),),
        )
        for key in unknown
    )
    return values


def _check_several(made: Checked) -> Checked:
    require_none(made.problems())
    return made


def require_none(problems: Iterable[Problem]) -> None:
    """Raise unless there are no problems; pydantic adds the location of the group."""
    errors = [
        InitErrorDetails(
            type=PydanticCustomError(
                # "radius is not a known parameter", but "radius: 3 is outside 0 .. 1 m".
                "predicate" if text.startswith("is ") else "refused",
                "{text}",
                {"text": text, _OTHERS: others, _DEPTH: len(location)},
            ),
            loc=location,
            input=None,
        )
        for text, location, others in problems
    ]
    if errors:
        raise ValidationError.from_exception_data("", errors)


def _refusal(
    error: ValidationError,
    place: Callable[[Location], str],
    name: Callable[[Location], str],
    *,
    contradicted: bool = False,
) -> ConfigurationError:
    texts = []
    for each in error.errors(include_url=False)[:_MOST]:
        text = place(each["loc"]) + _text(each, name(each["loc"]))
        others = [
            f"{name(other)}: {place(other).removesuffix(': ')}"
            for other in (_contradicted(each) if contradicted else ())
        ]
        texts.append(f"{text} ({'; '.join(others)})" if others else text)
    return ConfigurationError("; also ".join(texts))


def _contradicted(error: ErrorDetails) -> list[Location]:
    """Return the locations of the other values of a contradiction."""
    context = error.get("ctx", {})
    group = error["loc"][: len(error["loc"]) - context.get(_DEPTH, 0)]
    return [(*group, *other) for other in context.get(_OTHERS, ())]


_TEXTS = {
    "predicate": "{name} {text}",
    "value_error": "{name}: {error}",
    "missing": "{name} is missing",
    "greater_than": "{name}: {value} must be above {gt:g}",
    "greater_than_equal": "{name}: {value} must be at least {ge:g}",
    "finite_number": "{name}: {value} is not a finite number",
    "float_type": "{name}: {value} is not a number",
    "too_large": "{name}: {value} is too large",
    "int_type": "{name}: {value} is not a whole number",
    "bool_type": "{name}: {value} is neither true nor false",
    "tuple_type": "{name}: {value} is not a list",
    "too_long": "{name}: {value} has more than {max_length} values",
    "string_type": "{name}: {value} is not a valid name",
    "string_too_short": "{name}: {value} is not a valid name",
    "literal_error": "{name}: {value} is not a valid name; it must be {expected}",
    "dataclass_type": "{name} must be a mapping of names to values",
    "dict_type": "{name} must be a mapping of names to values",
}
"""Messages for the types of pydantic's errors; others are shown as pydantic's."""


def _text(error: ErrorDetails, name: str) -> str:
    if error["loc"][-1:] == ("[key]",):
        return f"{described(error['input'])} is not a name; quote it if it is meant as one"
    kind = error["type"]
    if kind == "float_type" and is_number(error["input"]):
        kind = "too_large"
    template = _TEXTS.get(kind, "{name}: {text}")
    values = {"text": error["msg"], "value": described(error["input"])} | error.get("ctx", {})
    return template.format(name=name or "the content", **values).removeprefix("the content: ")
