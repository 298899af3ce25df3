"""Parser for ROS 2 messages as JSON, into the same nodes as :mod:`ros_message_parser`."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from typing import Any, NoReturn

from bioscara.arguments import shown
from bioscara.errors import TrajectoryError
from bioscara.planning.files.ros_message_parser import DEPTH_MAX, ITEMS_MAX, Document, Node

_BEGIN = re.compile(r'\s*\{\s*["}]')


def is_json(text: str) -> bool:
    """Return whether a text begins as a JSON object, which YAML in brackets does not."""
    return _BEGIN.match(text) is not None


def json_document(text: str) -> Document:
    """Return the message in a text; numbers remain words, as the caller converts them.

    Raises:
        TrajectoryError: It is not one JSON object; the message names the line.
    """
    try:
        value = json.loads(
            text,
            parse_float=str,
            parse_int=str,
            parse_constant=_refuse_constant,
            object_pairs_hook=_fields,
        )
    except json.JSONDecodeError as error:
        # Only a part that is missing at its end can have been cut off.
        truncated = "; is the file truncated?" if error.pos >= len(text.rstrip()) else ""
        raise TrajectoryError(
            f"line {error.lineno}: not readable as JSON: {error.msg}{truncated}"
        ) from error
    except RecursionError:
        raise TrajectoryError(f"nested more than {DEPTH_MAX} deep") from None
    return Document(_node(value, 1), (), more=False)


def _refuse_constant(word: str) -> NoReturn:
    raise TrajectoryError(f"{word} is not a number; every value must be finite")


def _fields(pairs: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    fields = dict(pairs)
    if len(fields) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise TrajectoryError(f"{shown(twice)} stands twice")
    return fields


def _node(value: object, depth: int) -> Node:
    if depth > DEPTH_MAX:
        raise TrajectoryError(f"nested more than {DEPTH_MAX} deep")
    if isinstance(value, dict):
        return {name: _node(each, depth + 1) for name, each in value.items()}
    if isinstance(value, list):
        if len(value) > ITEMS_MAX:
            raise TrajectoryError(f"a list of more than {ITEMS_MAX} items; split the file")
        return [_node(each, depth + 1) for each in value]
    return None if value is None else str(value)
