"""Names of the parameters of each type of controller, with what ROS describes of them."""

from __future__ import annotations

import inspect
import math
import re
import sys
from collections.abc import Iterable, Iterator
from dataclasses import fields
from functools import cache
from typing import Any, Literal, NamedTuple, get_args, get_origin, get_type_hints

from bioscara.control.manager.registry import TYPES
from bioscara.model.validation import KNOWN_AS, Checked, Restricted
from bioscara.ros.controllers.parameters import ALSO_KNOWN, OF_NODES


class DescribedParameter(NamedTuple):
    """A parameter.

    Attributes:
        name: Its name, with dots.
        default: Its value where none is given; ``MISSING`` if it is required or a group.
        annotation: Type and bounds of its values.
        description: Its meaning.
    """

    name: str
    default: Any
    annotation: Any
    description: str

    @property
    def descriptor(self) -> Any:
        """The message that describes it; the type is that of its value."""
        # Imported here: names are known without ROS, too.
        from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor  # noqa: PLC0415

        bounds = (each for each in get_args(self.annotation)[1:] if isinstance(each, Restricted))
        ranges = [
            FloatingPointRange(from_value=each.at_least, to_value=sys.float_info.max)
            for each in bounds
            if math.isfinite(each.at_least)
        ]
        choices = get_args(self.annotation) if get_origin(self.annotation) is Literal else ()
        return ParameterDescriptor(
            name=self.name,
            description=self.description,
            additional_constraints=f"one of {', '.join(choices)}" if choices else "",
            floating_point_range=ranges,
        )


def known(kind: str, name: str) -> bool:
    """Return whether controllers of a type have a parameter; of an unknown type, they have all."""
    head, *keys = name.split(".")
    if kind not in TYPES or head in OF_NODES | ALSO_KNOWN.get(kind, frozenset()):
        return True
    return any(each.name == name for each in described(TYPES[kind].PARAMETERS, (head, *keys)))


def described(group: type[Checked], joints: Iterable[str]) -> Iterator[DescribedParameter]:
    """Yield the parameters in a group.

    Args:
        group: The group.
        joints: The names in the place of those of joints.
    """
    annotations, descriptions = _annotations(group), _descriptions(group)
    for each in fields(group):
        annotation = annotations[each.name]
        if get_origin(annotation) is dict:
            # Of the joints, whose names may be in the place of the group's.
            above = () if KNOWN_AS in each.metadata else (each.name,)
            for joint in joints:
                yield from _below((*above, joint), get_args(annotation)[1], joints)
        elif isinstance(annotation, type) and issubclass(annotation, Checked):
            yield from _below((each.name,), annotation, joints)
        else:
            yield DescribedParameter(
                each.name, each.default, annotation, descriptions.get(each.name, "")
            )


def _below(
    above: tuple[str, ...], group: Any, joints: Iterable[str]
) -> Iterator[DescribedParameter]:
    for each in described(group, joints):
        yield each._replace(name=".".join((*above, each.name)))


@cache
def _annotations(group: type[Checked]) -> dict[str, Any]:
    return get_type_hints(group, include_extras=True)


@cache
def _descriptions(group: type[Checked]) -> dict[str, str]:
    """Return the descriptions of attributes, from the docstring."""
    text = inspect.getdoc(group) or ""
    found = re.findall(r"^ {4}(\w+): (.+(?:\n {8}.+)*)", text, re.MULTILINE)
    return {name: " ".join(lines.split()) for name, lines in found}
