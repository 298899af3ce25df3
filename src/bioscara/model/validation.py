"""Groups of values from files, descriptions and programs, checked by pydantic.

A group of values is a subclass of :class:`Checked`. Its annotations are the checks of single
values, ``problems`` those of several. Every refusal is one :class:`ConfigurationError`. pydantic,
which loads slowly, is imported by the first check (:mod:`bioscara.model.schemas`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    NamedTuple,
    Self,
    TypeGuard,
    TypeVar,
    cast,
    dataclass_transform,
)

from bioscara.arguments import shown

if TYPE_CHECKING:
    from types import ModuleType

    from pydantic import GetCoreSchemaHandler
    from pydantic_core import CoreSchema

Location = tuple[str | int, ...]
"""Names and indices that lead to a value."""
KNOWN_AS = "known_as"
"""Key of a field's metadata: the word that a list of the known names has instead of its name."""


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


class Strict:
    """Annotation of a type: only its values are accepted, nothing is converted to it.

    Args:
        bounds: Further bounds of the values, by their names in the schemas of pydantic.

    Attributes:
        bounds: As given.
    """

    def __init__(self, **bounds: object) -> None:
        self.bounds = bounds

    def __get_pydantic_core_schema__(self, kind: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return _with(handler(kind), strict=True, **self.bounds)


class Before:
    """Annotation of a value that a function checks or changes before the type is checked.

    Args:
        function: Returns the value; raises a ``ValueError`` with the text of a :class:`Problem`.
    """

    def __init__(self, function: Callable[[Any], object]) -> None:
        self._function = function

    def __get_pydantic_core_schema__(self, kind: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        made: CoreSchema = _schemas().before(self._function, handler(kind))
        return made


class Within(NamedTuple):
    """Annotation of a ``float`` or ``int``: its range, and its unit for messages."""

    lower: float
    upper: float
    unit: str = ""

    def __get_pydantic_core_schema__(self, kind: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        whole = kind is int

        def check(value: object) -> object:
            if not is_number(value):
                return value
            # Before the conversion, which refuses integers beyond any float.
            for problem in outside(value, *self):
                raise ValueError(problem.text)
            return int(value) if whole and value == int(value) else value

        made: CoreSchema = _schemas().before(check, _with(handler(kind), strict=True))
        return made


def _not_zero(value: object) -> object:
    if is_number(value) and value == 0:
        raise ValueError("it must not be zero")
    return value


def _not_empty(value: object) -> object:
    if isinstance(value, list | tuple) and not value:
        raise ValueError("Value should have at least 1 item after validation, not 0")
    return value


_T = TypeVar("_T")

AS_TUPLE = Before(lambda value: tuple(value) if isinstance(value, list) else value)
"""Annotation of a strict tuple: a list is one too, nothing else."""
NOT_ZERO = Before(_not_zero)
"""Annotation of a number that is not zero."""
NOT_EMPTY = Before(_not_empty)
"""Annotation of a list that has a value."""
Number = Annotated[float, Strict()]
"""A number, also infinity and NaN: ``problems`` checks its range."""
Finite = Annotated[float, Strict(allow_inf_nan=False)]
Positive = Annotated[float, Strict(allow_inf_nan=False, gt=0.0)]
NotNegative = Annotated[float, Strict(allow_inf_nan=False, ge=0.0)]
Flag = Annotated[bool, Strict()]
Text = Annotated[str, Strict()]
Name = Annotated[str, Strict(min_length=1)]
Listed = Annotated[tuple[_T, ...], Strict(), AS_TUPLE]


class _Checking(type):
    """Type of the groups: making one by a call checks its values."""

    def __call__(cls, **values: Any) -> Any:
        return _schemas().called(cls, values)


@dataclass_transform(kw_only_default=True, frozen_default=True, field_specifiers=(field,))
@dataclass(frozen=True, kw_only=True)
class Checked(metaclass=_Checking):
    """Base of groups of values: frozen dataclasses that are checked whenever they are made.

    Raises:
        ConfigurationError: A name is unknown, a value is missing or cannot be used.
    """

    def __init_subclass__(cls) -> None:
        dataclass(frozen=True, kw_only=True)(cls)

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
        made: Self = _schemas().checked(
            cls, values, place, name or dotted, contradicted=contradicted
        )
        return made

    @classmethod
    def unchecked(cls, **values: Any) -> Self:
        """Return the group of values that were checked when a program was generated from them."""
        made: Self = type.__call__(cls, **values)
        return made

    @classmethod
    def parsed(cls, values: object) -> Self:
        """Return the group of these values, for the functions of :class:`Before`.

        Raises:
            ValidationError: As above, of pydantic, which adds the location of the outer group.
        """
        made: Self = _schemas().parsed(cls, values)
        return made

    @classmethod
    def parsed_by_name(cls, values: Mapping[str, object]) -> dict[str, Self]:
        """Return groups of these values by their names; errors as :meth:`parsed`."""
        made: dict[str, Self] = _schemas().parsed(dict[str, cls], values)  # type: ignore[valid-type]
        return made

    @classmethod
    def arranged(cls, values: Mapping[Any, object]) -> Mapping[Any, object]:
        """Return the values by field, if a file has them in another arrangement."""
        return values

    def problems(self) -> Iterable[Problem]:
        """Yield contradictions between values that are valid alone."""
        return ()

    @classmethod
    def __get_pydantic_core_schema__(cls, _: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        made: CoreSchema = _schemas().group(cls, handler)
        return made


def require_none(problems: Iterable[Problem]) -> None:
    """Raise unless there are no problems, for the functions of :class:`Before`.

    Raises:
        ValidationError: There are some, of pydantic, which adds the location of the outer group.
    """
    _schemas().require_none(problems)


def _schemas() -> ModuleType:
    # Imported by the first check: pydantic loads slowly, and many programs check nothing.
    from bioscara.model import schemas  # noqa: PLC0415

    return schemas


def _with(schema: CoreSchema, **entries: object) -> CoreSchema:
    return cast("CoreSchema", {**schema, **entries})


def is_number(value: object) -> TypeGuard[float]:
    """Return whether a value is a number; truth values are none."""
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
