"""Tasks from values as files and the page have them, and back; with all problems at once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple, TypeVar

import msgspec

from bioscara.errors import InvalidArgumentError
from bioscara.model.validation import Problem, described
from bioscara.robot.tasks.checks import metadata
from bioscara.robot.tasks.forms import PoseForm
from bioscara.spelling import did_you_mean

S = TypeVar("S", bound=msgspec.Struct)

RENAMED = {"speed": "velocity_scaling", "joints": "positions", "name": "pose", "via_name": "via"}
"""Names of fields in older files, and those that they have now."""


class Unusable(NamedTuple):
    """Why values cannot be used.

    Attributes:
        problems: Every problem, with the location of its value.
    """

    problems: tuple[Problem, ...]


def struct_of(kind: type[S], values: object) -> S | Unusable:
    """Return the struct of these values.

    Args:
        kind: The struct: a task or a form.
        values: Its fields, by name; those that have a form are written in it.
    """
    if not isinstance(values, Mapping):
        return Unusable((Problem(f"{described(values)} is not a mapping of names to values"),))
    fields = {each.name: each for each in msgspec.structs.fields(kind)}
    problems = [_unknown(str(key), fields) for key in values if key not in fields]
    made: dict[str, Any] = {}
    for name, field in fields.items():
        if name in values:
            value = _value_of(field.type, name, values[name])
            if isinstance(value, Unusable):
                problems += [Problem(each.text, (name, *each.location)) for each in value.problems]
            made[name] = value
        elif field.required and not any(RENAMED.get(str(key)) == name for key in values):
            problems.append(Problem("is missing", (name,)))
    if problems:
        return Unusable(tuple(problems))
    try:
        return kind(**made)
    except InvalidArgumentError as error:
        return Unusable((Problem(str(error)),))


def _unknown(name: str, fields: Mapping[str, object]) -> Problem:
    new = RENAMED.get(name)
    if new in fields:
        return Problem(f"is called {new} now", (name,))
    hint = did_you_mean(name, fields, f"known here: {', '.join(fields)}")
    return Problem(f"is not a known parameter; {hint}", (name,))


def _value_of(kind: Any, name: str, given: object) -> Any:
    """Return the value of a field, or why it cannot be used."""
    extra = metadata(kind)
    if given is None and type(None) in getattr(kind, "__args__", ()):
        return None
    form = extra.get("form")
    try:
        if form is not None and not isinstance(given, str):
            written = struct_of(form, given)
            return written if isinstance(written, Unusable) else written.made()
        if "check" in extra:
            # The name is that of the location.
            return extra["check"]("", given)
        return msgspec.convert(given, kind)
    except (InvalidArgumentError, msgspec.ValidationError) as error:
        return Unusable((Problem(str(error).removeprefix(name).lstrip(": "), ()),))


def values_of(value: msgspec.Struct) -> dict[str, object]:
    """Return a struct as plain values, without those that are the default."""
    return dict(_entries(value))


def _entries(value: msgspec.Struct) -> Iterator[tuple[str, object]]:
    fields = msgspec.structs.fields(type(value))
    # Those of the base are the first; people look for the target there.
    own = [each for each in fields if not each.name.endswith("_scaling")]
    for field in [*own, *(each for each in fields if each not in own)]:
        held = getattr(value, field.name)
        # Poses are written whole: four numbers are easier to read than three.
        whole = field.required or isinstance(value, PoseForm)
        if not whole and held == field.default:
            continue
        form = metadata(field.type).get("form")
        if form is not None and not isinstance(held, str):
            yield field.name, values_of(form.of(held))
        else:
            yield field.name, list(held) if isinstance(held, tuple) else held
