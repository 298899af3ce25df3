"""Checks of values from files, descriptions and programs, by pydantic.

A group of values is a subclass of :class:`Checked`. Its annotations are the checks of single
values, ``problems`` those of several. Every refusal is one :class:`ConfigurationError`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import field, fields
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    ClassVar,
    LiteralString,
    NamedTuple,
    Self,
    TypeGuard,
    TypeVar,
    dataclass_transform,
)

from pydantic import (
    BeforeValidator,
    Field,
    GetCoreSchemaHandler,
    Strict,
    ValidationError,
    model_validator,
)
from pydantic.dataclasses import dataclass
from pydantic_core import (
    ArgsKwargs,
    CoreSchema,
    ErrorDetails,
    InitErrorDetails,
    PydanticCustomError,
    SchemaValidator,
    core_schema,
)

from bioscara.arguments import shown
from bioscara.errors import ConfigurationError
from bioscara.spelling import did_you_mean

Location = tuple[str | int, ...]
"""Names and indices that lead to a value."""
KNOWN_AS = "known_as"
"""Key of a field's metadata: what a list of the known names has instead of its name."""
_MOST = 5
"""Errors that one message names."""
_OTHERS, _DEPTH = "others", "depth"
"""Keys of an error's context: fields of its :class:`Problem`, the length of its location."""


class Problem(NamedTuple):
    """Reason why a value is refused.

    Attributes:
        text: The message after the value's name.
        location: The value within its group; empty for the group itself.
        others: Other values of the group that it contradicts.
    """

    text: str
    location: Location = ()
    others: tuple[Location, ...] = ()


def outside(
    value: float,
    lower: float,
    upper: float,
    unit: str,
    *location: str | int,
    others: tuple[Location, ...] = (),
) -> Iterator[Problem]:
    """Yield a problem if a number is not from ``lower`` to ``upper``, which follow from others."""
    if not lower <= value <= upper:
        text = f"{described(value)} is outside {lower:g} .. {upper:g} {unit}"
        yield Problem(text.rstrip(), location, others)


def not_above(
    value: float, lower: float, *location: str | int, others: tuple[Location, ...] = ()
) -> Iterator[Problem]:
    """Yield a problem if a number is not above ``lower``, which follows from others."""
    if not value > lower:
        yield Problem(f"{value:g} must be above {lower:g}", location, others)


class Within(NamedTuple):
    """Annotation of a ``float`` or ``int``: its range, and its unit for messages."""

    lower: float
    upper: float
    unit: str = ""

    def __get_pydantic_core_schema__(self, kind: Any, _: GetCoreSchemaHandler) -> CoreSchema:
        whole = kind is int
        plain = core_schema.int_schema if whole else core_schema.float_schema

        def check(value: object) -> object:
            if not _is_number(value):
                return value
            # Before the conversion, which refuses integers beyond any float.
            for problem in outside(value, *self):
                raise PydanticCustomError("refused", "{text}", {"text": problem.text})
            return int(value) if whole and value == int(value) else value

        return core_schema.no_info_before_validator_function(check, plain(strict=True))


def _not_zero(value: object) -> object:
    if _is_number(value) and value == 0:
        raise PydanticCustomError("refused", "it must not be zero")
    return value


_T = TypeVar("_T")

AS_TUPLE = BeforeValidator(lambda value: tuple(value) if isinstance(value, list) else value)
"""Annotation of a strict tuple: a list is one too, nothing else."""
NOT_ZERO = BeforeValidator(_not_zero)
"""Annotation of a number that is not zero."""
Number = Annotated[float, Strict()]
"""A number, also infinity and NaN: ``problems`` checks its range."""
Finite = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0.0)]
NotNegative = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0.0)]
Flag = Annotated[bool, Strict()]
Text = Annotated[str, Strict()]
Name = Annotated[str, Field(strict=True, min_length=1)]
Listed = Annotated[tuple[_T, ...], Strict(), AS_TUPLE]


class _Refusing(type):
    """Type of the groups: making one by a call raises our error, not pydantic's."""

    def __call__(cls, *args: Any, **values: Any) -> Any:
        try:
            return super().__call__(*args, **values)
        except ValidationError as error:
            raise _refusal(error, lambda _: f"{cls.__name__}: ", dotted) from error


@dataclass_transform(kw_only_default=True, frozen_default=True, field_specifiers=(field,))
@dataclass(frozen=True, kw_only=True)
class Checked(metaclass=_Refusing):
    """Base of groups of values: frozen dataclasses that are checked whenever they are made.

    Raises:
        ConfigurationError: A name is unknown, a value is missing or cannot be used.
    """

    if TYPE_CHECKING:
        __pydantic_validator__: ClassVar[SchemaValidator]

    def __init_subclass__(cls) -> None:
        # Built when first used: importing builds none of the groups that others contain.
        dataclass(frozen=True, kw_only=True, config={"defer_build": True})(cls)

    @classmethod
    def checked(
        cls,
        values: object,
        place: Callable[[Location], str],
        name: Callable[[Location], str] | None = None,
        *,
        contradicted: bool = False,
    ) -> Self:
        """Return the group of these values.

        Args:
            values: By name.
            place: Returns the begin of a message about a value, as ``"arm.yaml, line 3: "``.
            name: Returns the value's name in a message; its dotted path by default.
            contradicted: Whether a message also has the places of the values that a value
                contradicts, which may be in another file.

        Raises:
            ConfigurationError: As above; the message has the first errors.
        """
        try:
            return cls.parsed(values)
        except ValidationError as error:
            raise _refusal(error, place, name or dotted, contradicted=contradicted) from error

    @classmethod
    def parsed(cls, values: object) -> Self:
        """Return the group of these values, for validators of another group.

        Raises:
            ValidationError: As above; pydantic adds the location of the other group.
        """
        made: Self = cls.__pydantic_validator__.validate_python(values)
        return made

    def problems(self) -> Iterable[Problem]:
        """Yield contradictions between values that are valid alone."""
        return ()

    @model_validator(mode="before")
    @classmethod
    def _refuse_unknown(cls, values: object) -> object:
        """Refuse unknown names before all else: a misspelt value would be missing, too."""
        if isinstance(values, Mapping):
            values = given = dict(values)
        elif isinstance(values, ArgsKwargs):
            given = values.kwargs or {}
        else:
            return values
        known = {each.name: each.metadata.get(KNOWN_AS, each.name) for each in fields(cls)}
        unknown = [key for key in given if key not in known][:_MOST]
        listed = f"known here: {', '.join(known.values())}"
        _refuse(
            "unknown",
            [
                Problem(
                    f"is not a known parameter; {did_you_mean(str(key), known, listed)}",
                    (key if isinstance(key, str | int) else str(key),),
                )
                for key in unknown
            ],
        )
        return values

    @model_validator(mode="after")
    def _check_several(self) -> Self:
        _refuse("refused", self.problems())
        return self


def _refuse(kind: LiteralString, problems: Iterable[Problem]) -> None:
    """Raise unless there are no problems; pydantic adds the location of the group."""
    errors = [
        InitErrorDetails(
            type=PydanticCustomError(
                kind, "{text}", {"text": text, _OTHERS: others, _DEPTH: len(location)}
            ),
            loc=location,
            input=None,
        )
        for text, location, others in problems
    ]
    if errors:
        raise ValidationError.from_exception_data("", errors)


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool)


def described(value: object) -> str:
    """Return a value of a file as shown in an error.

    Collections are shown by their size: anchors may make their content endless.
    """
    if isinstance(value, dict | list | tuple):
        kind = "mapping" if isinstance(value, dict) else "list"
        return f"a {kind} of {len(value)}"
    return f"{value:g}" if isinstance(value, float) else shown(value)


def dotted(location: Location) -> str:
    """Return the path of a value, as ``zones[0].radius``."""
    names = (f"[{key}]" if isinstance(key, int) else f".{key}" for key in location)
    return "".join(names).removeprefix(".")


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
    "unknown": "{name} {text}",
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
    if kind == "float_type" and _is_number(error["input"]):
        kind = "too_large"
    template = _TEXTS.get(kind, "{name}: {text}")
    values = {"text": error["msg"], "value": described(error["input"])} | error.get("ctx", {})
    return template.format(name=name or "the content", **values).removeprefix("the content: ")
