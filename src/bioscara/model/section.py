"""Named values of a file, of a description or of a program, checked one by one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import Any

from bioscara.arguments import shown
from bioscara.errors import ConfigurationError
from bioscara.spelling import did_you_mean


class Section(ABC):
    """Group of named values; each error states the name, location and limit of the value.

    Keys are the names of the fields that the values fill.
    """

    @abstractmethod
    def value(self, key: str) -> Any:
        """Return the value as written in the file.

        Raises:
            ConfigurationError: There is none.
        """

    @abstractmethod
    def name(self, key: str) -> str:
        """Return the name of the value in the file."""

    @abstractmethod
    def error(self, text: str, key: str | None = None) -> ConfigurationError:
        """Return an error that states the location of the value of ``key``."""

    @abstractmethod
    def keys(self) -> Iterable[str]:
        """Return the keys of this section of the file."""

    def number(self, key: str, lower: float, upper: float, unit: str = "") -> float:
        """Return a finite number from ``lower`` to ``upper``.

        Raises:
            ConfigurationError: It is missing, no number, or outside; likewise for the methods
                below.
        """
        value = self.value(key)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.error(f"{self.name(key)}: {described(value)} is not a number", key)
        if not lower <= value <= upper:
            text = f"{value:g}" if isinstance(value, float) else described(value)
            text = f"{self.name(key)}: {text} is outside {lower:g} .. {upper:g} {unit}"
            raise self.error(text.rstrip(), key)
        return float(value)

    def whole(self, key: str, lower: int, upper: int, unit: str = "") -> int:
        """Return a whole number from ``lower`` to ``upper``."""
        value = self.number(key, lower, upper, unit)
        if not value.is_integer():
            raise self.error(f"{self.name(key)}: {value:g} is not a whole number", key)
        return int(value)

    def nonzero(self, key: str, size: float, unit: str = "") -> float:
        """Return a number of at most ``size`` in either direction, which is not zero."""
        value = self.number(key, -size, size, unit)
        if value == 0.0:
            raise self.error(f"{self.name(key)}: it must not be zero", key)
        return value

    def above(self, key: str, lower: float, upper: float, unit: str = "") -> float:
        """Return a number above ``lower``, up to ``upper``."""
        value = self.number(key, -upper, upper, unit)
        if value <= lower:
            raise self.error(f"{self.name(key)}: {value:g} must be above {lower:g}", key)
        return value

    def flag(self, key: str) -> bool:
        """Return true or false."""
        value = self.value(key)
        if not isinstance(value, bool):
            raise self.error(f"{self.name(key)}: {described(value)} is neither true nor false", key)
        return value

    def text(self, key: str, allowed: tuple[str, ...] = (), *, empty: bool = False) -> str:
        """Return a text, one of ``allowed`` if there are any; ``empty`` allows the empty one."""
        value = self.value(key)
        if isinstance(value, str) and (value in allowed if allowed else value or empty):
            return value
        several = "one of " if len(allowed) > 1 else ""
        choice = f"; it must be {several}{', '.join(allowed) or 'empty'}" if allowed else ""
        text = f"{self.name(key)}: {described(value)} is not a valid name{choice}"
        raise self.error(text, key)

    def refuse_unknown(self, known: Iterable[str], named: Iterable[str] = ()) -> None:
        """Raise if there is a key that is not ``known``, with a suggestion.

        To be called before anything is read: reporting a misspelt key helps more than a missing
        one.

        Args:
            known: The known keys.
            named: What to name as known instead.
        """
        names = sorted(known)
        for key in self.keys():
            if key in names:
                continue
            listed = ", ".join(filter(None, named)) or ", ".join(names)
            hint = did_you_mean(str(key), names, f"known here: {listed}")
            raise self.error(f"{self.name(str(key))} is not a known parameter; {hint}", key)


def described(value: object) -> str:
    """Return a value of a file as shown in an error.

    Collections are shown by their size: anchors may make their content endless.
    """
    if isinstance(value, dict | list):
        kind = "mapping" if isinstance(value, dict) else "list"
        return f"a {kind} of {len(value)}"
    return shown(value)
