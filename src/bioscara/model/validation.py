"""Groups of values from files, descriptions and programs, checked.

A group of values is a subclass of :class:`Checked`. Its annotations are the checks of single
values, ``problems`` those of several. Every refusal is one :class:`ConfigurationError`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import MISSING, dataclass, field, fields
from functools import cache
from types import UnionType
from typing import (
    Annotated,
    Any,
    Literal,
    NamedTuple,
    Self,
    TypeGuard,
    Union,
    cast,
    dataclass_transform,
    get_args,
    get_origin,
    get_type_hints,
)

from bioscara.arguments import shown
from bioscara.errors import ConfigurationError
from bioscara.spelling import did_you_mean

Location = tuple[str | int, ...]
"""Names and indices that lead to a value."""
KNOWN_AS = "known_as"
"""Key of a field's metadata: the word that a list of the known names has instead of its name."""
_KEY = "[key]"
"""End of the location of a name that cannot be used."""
_MOST = 5
"""Problems that one message names."""
_NO_MAPPING = "must be a mapping of names to values"


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


class ProblemsError(Exception):
    """A value cannot be used.

    Attributes:
        problems: The reasons, with locations from the value.
    """

    def __init__(self, *problems: Problem) -> None:
        self.problems = problems
        super().__init__(*problems)


@dataclass(frozen=True)
class Restricted:
    """Annotation of a finite number or a text: its bounds.

    Attributes:
        above: A number is above it.
        at_least: A number is not below it.
        pattern: Regular expression of a whole text.
    """

    above: float = -math.inf
    at_least: float = -math.inf
    pattern: str = ""

    def check(self, value: Any) -> None:
        """Raise :class:`ProblemsError` if a value of the type is outside of the bounds."""
        text = described(value)
        if isinstance(value, str):
            named = re.fullmatch(self.pattern, value, re.DOTALL)
            _require(named, f"{text} is not a valid name")
            return
        _require(math.isfinite(value), f"{text} is not a finite number")
        _require(value >= self.at_least, f"{text} must be at least {self.at_least:g}")
        _require(value > self.above, f"{text} must be above {self.above:g}")


class Before(NamedTuple):
    """Annotation of a value that a function checks or changes before the type is checked.

    Attributes:
        function: Returns the value; raises a ``ValueError`` with the text of a :class:`Problem`.
    """

    function: Callable[[Any], object]


class Within(NamedTuple):
    """Annotation of a ``float`` or ``int``: its range, and its unit for messages."""

    lower: float
    upper: float
    unit: str = ""

    def check(self, value: object) -> None:
        """Raise :class:`ProblemsError` if a number is outside; the type refuses anything else.

        It is checked before the conversion, which refuses integers beyond any float.
        """
        if is_number(value) and (problems := [*outside(value, *self)]):
            raise ProblemsError(*problems)


def _not_zero(value: object) -> object:
    if is_number(value) and value == 0:
        raise ValueError("it must not be zero")
    return value


def _not_empty(value: object) -> object:
    if isinstance(value, list | tuple) and not value:
        raise ValueError("it must have at least one value")
    return value


NOT_ZERO = Before(_not_zero)
"""Annotation of a number that is not zero."""
NOT_EMPTY = Before(_not_empty)
"""Annotation of a list that has a value."""
Finite = Annotated[float, Restricted()]
Positive = Annotated[float, Restricted(above=0.0)]
NotNegative = Annotated[float, Restricted(at_least=0.0)]
Name = Annotated[str, Restricted(pattern=".+")]


class _Checking(type):
    """Type of the groups: making one by a call checks its values."""

    def __call__(cls, **values: Any) -> Any:
        with _refusing(lambda _: f"{cls.__name__}: ", dotted):
            return _made(cast("type[Checked]", cls), values)


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
        with _refusing(place, name or dotted, contradicted=contradicted):
            return cls.parsed(values)

    @classmethod
    def unchecked(cls, **values: Any) -> Self:
        """Return the group of values that were checked when a program was generated from them."""
        made: Self = type.__call__(cls, **values)
        return made

    @classmethod
    def parsed(cls, values: object) -> Self:
        """Return the group of these values, for the functions of :class:`Before`.

        Raises:
            ProblemsError: As above, without the location of the outer group.
        """
        made: Self = parsed(cls, values)
        return made

    @classmethod
    def arranged(cls, values: Mapping[Any, object]) -> Mapping[Any, object]:
        """Return the values by field, if a file has them in another arrangement."""
        return values

    def problems(self) -> Iterable[Problem]:
        """Yield contradictions between values that are valid alone."""
        return ()


def require_none(problems: Iterable[Problem]) -> None:
    """Raise unless there are no problems, for the functions of :class:`Before`.

    Raises:
        ProblemsError: There are some, without the location of the outer group.
    """
    if found := [*problems]:
        raise ProblemsError(*found)


def _require(fits: object, text: str) -> None:
    if not fits:
        raise ProblemsError(Problem(text))


def parsed(kind: Any, value: Any) -> Any:
    """Convert a value to the type of a field.

    Nothing is converted, except a list to a tuple and a whole number to a float.

    Raises:
        ProblemsError: It cannot be used.
    """
    origin, inner = get_origin(kind), get_args(kind)
    if isinstance(kind, _Checking):
        return _group(cast("type[Checked]", kind), value)
    if origin in (UnionType, Union):
        # Of a group of several kinds, a function before has made one of them already.
        return value if type(value) in inner else parsed(inner[0], value)
    if origin is Literal:
        expected = " or ".join(map(repr, inner)).replace(" or ", ", ", max(len(inner) - 2, 0))
        known = isinstance(value, str) and value in inner
        _require(known, f"{described(value)} is not a valid name; it must be {expected}")
        return value
    if origin is None:
        return value if kind is Any else _scalar(kind, value)
    return {Annotated: _annotated, tuple: _tuple, dict: _by_name}[origin](inner, value)


def _annotated(inner: tuple[Any, ...], value: Any) -> Any:
    (kind, *notes), after = inner, []
    for note in reversed(notes):
        if isinstance(note, Before):
            value = _refused_as_problem(note.function, value)
        elif isinstance(note, Within):
            note.check(value)
            if kind is int and isinstance(value, float) and value.is_integer():
                value = int(value)
        else:
            after.append(note)
    made = parsed(kind, value)
    for bounds in after:
        bounds.check(made)
    return made


def _refused_as_problem(function: Callable[[Any], Any], value: Any) -> Any:
    try:
        return function(value)
    except ValueError as error:
        raise ProblemsError(Problem(str(error))) from None


_SCALARS = {
    float: "is not a number",
    int: "is not a whole number",
    bool: "is neither true nor false",
    str: "is not a valid name",
}
"""What a value of another type than this one is refused with."""


def _scalar(kind: type, value: Any) -> Any:
    fits = is_number(value) if kind is float else isinstance(value, kind)
    wrong = not fits or (kind is int and isinstance(value, bool))
    _require(not wrong, f"{described(value)} {_SCALARS[kind]}")
    try:
        # That of a file may be of a type that remembers how it was written.
        return kind(value)
    except OverflowError:
        raise ProblemsError(Problem(f"{described(value)} is too large")) from None


def _tuple(kinds: tuple[Any, ...], value: Any) -> tuple[Any, ...]:
    _require(isinstance(value, list | tuple), f"{described(value)} is not a list")
    if kinds[1:] == (...,):
        kinds = kinds[:1] * len(value)
    most = f"{described(value)} has more than {len(kinds)} values"
    _require(len(value) <= len(kinds), most)
    given = dict(enumerate(value))
    return tuple(_every((place, kind, given) for place, kind in enumerate(kinds)).values())


def _by_name(inner: tuple[Any, ...], value: Any) -> dict[str, Any]:
    _require(isinstance(value, Mapping), _NO_MAPPING)
    made, problems = _each((key, inner[1], value) for key in value)
    unnamed = [
        Problem(
            f"{described(key)} is not a name; quote it if it is meant as one",
            (key if isinstance(key, int) else str(key), _KEY),
        )
        for key in value
        if not isinstance(key, str)
    ]
    require_none([*unnamed, *problems])
    return made


def _every(wanted: Iterable[tuple[Any, Any, Mapping[Any, Any]]]) -> dict[Any, Any]:
    """Return values by their keys; all that cannot be used are refused together."""
    made, problems = _each(wanted)
    require_none(problems)
    return made


def _each(
    wanted: Iterable[tuple[Any, Any, Mapping[Any, Any]]],
) -> tuple[dict[Any, Any], list[Problem]]:
    """Return the values that can be used, by their keys, and the problems of the others.

    Args:
        wanted: Key and type of each value, and where it is.
    """
    made, problems = dict[Any, Any](), list[Problem]()
    for key, kind, values in wanted:
        try:
            _require(key in values, "is missing")
            made[key] = parsed(kind, values[key])
        except ProblemsError as refused:
            problems += [
                Problem(text, (key, *inner), tuple((key, *other) for other in others))
                for text, inner, others in refused.problems
            ]
    return made, problems


def _group(kind: type[Checked], values: Any) -> Checked:
    if isinstance(values, kind):
        return values
    _require(isinstance(values, Mapping), _NO_MAPPING)
    return _made(kind, _refused_as_problem(kind.arranged, values))


def _made(kind: type[Checked], given: Mapping[Any, object]) -> Checked:
    """Refuse unknown names before all else: a misspelt value would be missing, too."""
    own = fields(kind)
    known = {each.name: each.metadata.get(KNOWN_AS, each.name) for each in own}
    listed = f"known here: {', '.join(known.values())}"
    require_none(
        Problem(
            f"is not a known parameter; {did_you_mean(str(key), known, listed)}",
            (key if isinstance(key, str | int) else str(key),),
        )
        for key in given
        if key not in known
    )
    hints = _hints(kind)
    needed = [
        each.name
        for each in own
        if each.name in given or (each.default is MISSING and each.default_factory is MISSING)
    ]
    made = kind.unchecked(**_every((name, hints[name], given) for name in needed))
    require_none(made.problems())
    return made


@cache
def _hints(kind: type[Checked]) -> dict[str, Any]:
    return get_type_hints(kind, include_extras=True)


@contextmanager
def _refusing(
    place: Callable[[Location], str],
    name: Callable[[Location], str],
    *,
    contradicted: bool = False,
) -> Iterator[None]:
    """Raise one ConfigurationError with the first problems of what is made within."""
    try:
        yield
    except ProblemsError as refused:
        texts = []
        for text, location, others in refused.problems[:_MOST]:
            # "radius is not a known parameter", but "radius: 3 is outside 0 .. 1 m".
            joint = " " if text.startswith(("is ", _NO_MAPPING)) else ": "
            whole = f"{name(location) or 'the content'}{joint}{text}".removeprefix("the content: ")
            places = [
                f"{name(other)}: {place(other).removesuffix(': ')}"
                for other in (others if contradicted else ())
            ]
            texts.append(
                f"{place(location)}{text if location[-1:] == (_KEY,) else whole}"
                + (f" ({'; '.join(places)})" if places else "")
            )
        raise ConfigurationError("; also ".join(texts)) from refused


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
