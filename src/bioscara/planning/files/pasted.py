"""Messages in text that was copied from a terminal: a command of ``ros2``, or its output."""

from __future__ import annotations

import re

_COMMAND = re.compile(r"""\s*(?:\$ *)?(?:ros2 [^"'{]*)?(["'])\s*(\{.*\})\s*\1[^"'{}]*""", re.DOTALL)
_PRINTED = re.compile(r"^(?:Sending goal|Result):\n +", re.MULTILINE)
_AFTER = "\n\nGoal "
_POINTS = re.compile(r"^ *points:$", re.MULTILINE)


def message_in(text: str) -> str:
    """Return the message in a text.

    It may be the argument of ``ros2 action send_goal`` or ``ros2 topic pub``, with its quotes and
    with the command before it; or the goal or result that has points in what ``send_goal`` prints.

    Args:
        text: Content of a file; returned as it is where it is neither.
    """
    command = _COMMAND.fullmatch(text)
    if command is not None:
        return command[2]
    end = 0
    while (heading := _PRINTED.search(text, end)) and (
        end := text.find(_AFTER, heading.end())
    ) >= 0:
        printed = text[heading.end() : end]
        if _POINTS.search(printed):
            return f"{printed}\n---\n"
    return text
