"""Parameters of controllers: strict, with the field's names and defaults."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, Field, dataclass, field, fields
from types import UnionType
from typing import (
    Annotated,
    Any,
    ClassVar,
    Literal,
    NamedTuple,
    Self,
    dataclass_transform,
    get_args,
    get_origin,
    get_type_hints,
)

from bioscara.errors import ConfigurationError
from bioscara.model.parameters import HIGHEST_RATE
from bioscara.model.section import Section, described

_LARGEST = sys.float_info.max
_EACH = "a group for each joint"


class Interval(NamedTuple):
    """Range of a number, as annotation of a parameter.

    Attributes:
        lower: Lowest value.
        upper: Highest value.
        above: Whether the lowest value itself is excluded.
    """

    lower: float = -_LARGEST
    upper: float = _LARGEST
    above: bool = False


Positive = Annotated[float, Interval(0.0, above=True)]
NotNegative = Annotated[float, Interval(0.0)]
Unbounded = Annotated[float, Interval(-math.inf, math.inf)]
Rate = Annotated[int, Interval(0, HIGHEST_RATE)]
Name = Annotated[str, "not empty"]


@dataclass_transform(kw_only_default=True, frozen_default=True, field_specifiers=(field,))
class ParameterGroup:
    """Base of all parameter groups: frozen dataclasses whose values are checked by their types.

    Unknown names, other types and infinity are refused.

    Raises:
        ConfigurationError: A value cannot be used; names it.
    """

    PER_JOINT: ClassVar[str] = ""
    """Name of the field with a group for each joint, which parameter files have under the joint's
    name next to the other values; empty where there is none."""

    def __init_subclass__(cls) -> None:
        dataclass(frozen=True, kw_only=True)(cls)

    def __post_init__(self) -> None:
        given = _Values(type(self).__name__, "", vars(self))
        for name, hint in _hints(type(self)).items():
            object.__setattr__(self, name, _read(given, name, hint))

    @classmethod
    def from_section(cls, section: _Values) -> Self:
        """Return the group with the values of a section.

        Raises:
            ConfigurationError: A name is unknown, or a value cannot be used; names both.
        """
        hints, joints = dict(_hints(cls)), {}
        if cls.PER_JOINT:
            _, group = get_args(hints.pop(cls.PER_JOINT))
            joints = {name: group for name in section.groups() if name not in hints}
        section.refuse_unknown((*hints, *joints), (*hints, cls.PER_JOINT and _EACH))
        needed = {each.name for each in fields(cls) if _required(each)}  # type: ignore[arg-type]
        given = {
            name: _read(section, name, hint)
            for name, hint in hints.items()
            if name in needed or name in section.keys()  # noqa: SIM118
        }
        if cls.PER_JOINT:
            given[cls.PER_JOINT] = {name: _read(section, name, joints[name]) for name in joints}
        try:
            return cls(**given)
        except ConfigurationError as error:
            raise section.error(f"{section.where}: {error}".removeprefix(": ")) from error


class Parameters(ParameterGroup):
    """Base of every controller's parameters; names and defaults are those of ros2_controllers.

    Attributes:
        update_rate: Updates per second [Hz]; 0 for every cycle.
        fallback_controllers: Controllers that take over when this one fails.
    """

    update_rate: Rate = 0
    fallback_controllers: tuple[str, ...] = ()

    @classmethod
    def read(cls, controller: str, values: Mapping[str, object]) -> Self:
        """Return the checked parameters.

        Args:
            controller: Name of the controller, for messages.
            values: As in the controller's section of a parameter file.

        Raises:
            ConfigurationError: A name is unknown, or a value cannot be used; names both.
        """
        return cls.from_section(_Values(controller, "", values))


class _Values(Section):
    """Values that a program passes, as a mapping.

    Args:
        owner: Name of the controller, for messages.
        where: Dotted name of the group; empty for the parameters themselves.
        values: By name.

    Attributes:
        where: As given.

    Raises:
        ConfigurationError: They are no mapping.
    """

    def __init__(self, owner: str, where: str, values: object) -> None:
        self._owner, self.where = owner, where
        if not isinstance(values, Mapping):
            raise self.error(f"{where or 'the parameters'} must be a mapping of names to values")
        self._values = values

    def error(self, text: str, key: str | None = None) -> ConfigurationError:
        return ConfigurationError(f"{self._owner}: {text}")

    def name(self, key: str) -> str:
        return f"{self.where}.{key}" if self.where else str(key)

    def keys(self) -> Iterable[str]:
        return tuple(self._values)

    def value(self, key: str) -> Any:
        if key not in self._values:
            raise self.error(f"{self.name(key)} is missing")
        return self._values[key]

    def group(self, key: str) -> _Values:
        """Return the mapping or list at ``key``; items of a list are named by their indices."""
        value = self.value(key)
        if isinstance(value, list | tuple):
            value = {str(index): item for index, item in enumerate(value)}
        return _Values(self._owner, self.name(key), value)

    def groups(self) -> list[str]:
        """Return the names of all groups."""
        return [
            name
            for name, value in self._values.items()
            if isinstance(name, str) and isinstance(value, Mapping | ParameterGroup)
        ]


def _hints(group: Any) -> dict[str, Any]:
    """Return the types of a group's fields."""
    hints = get_type_hints(group, include_extras=True)
    return {name: hint for name, hint in hints.items() if get_origin(hint) is not ClassVar}


def _required(each: Field[Any]) -> bool:
    return each.default is MISSING and each.default_factory is MISSING


def _read(section: _Values, key: str, hint: Any) -> Any:  # noqa: PLR0911
    """Return a value, checked by the type of its field."""
    origin, inner = get_origin(hint), get_args(hint)
    if origin is Annotated:
        kind, bounds = inner
        if kind is str:
            return section.text(key)
        lower, upper, above = bounds
        if kind is int:
            return section.whole(key, lower, upper)
        return (section.above if above else section.number)(key, lower, upper)
    if hint is float:
        return section.number(key, -_LARGEST, _LARGEST)
    if hint is bool:
        return section.flag(key)
    if hint is str or origin is Literal:
        return section.text(key, inner, empty=True)
    if origin is UnionType:
        return None if section.value(key) is None else _read(section, key, inner[0])
    if origin is dict:
        group = section.group(key)
        return {name: _read(group, name, inner[1]) for name in group.keys()}  # noqa: SIM118
    if origin is tuple:
        return _items(section, key, inner)
    value = section.value(key)
    return value if isinstance(value, hint) else hint.from_section(section.group(key))


def _items(section: _Values, key: str, hints: tuple[Any, ...]) -> tuple[Any, ...]:
    value = section.value(key)
    count = len(value) if isinstance(value, list | tuple) else -1
    if hints[-1] is ...:
        hints = hints[:1] * count
    if count != len(hints):
        text = f"{section.name(key)}: {described(value)} is not a list"
        raise section.error(text if count < 0 else f"{text} of {len(hints)} values", key)
    group = section.group(key)
    return tuple(_read(group, str(index), hint) for index, hint in enumerate(hints))
