"""Warnings of an arm: what stopped nothing, and a person should see all the same."""

from __future__ import annotations

import math


class ArmWarning(str):
    """The text of a warning, which begins with the call that it concerns.

    Args:
        text: What happened.
        time: When it happened [s], on the arm's clock.
        call: The call that it concerns, for example ``"home()"``; empty for none.
        author: Key of the client whose motion it concerns alone; empty for all.

    Attributes:
        time: As given; NaN if it is not known.
        author: As given.
    """

    time: float
    author: str

    def __new__(
        cls, text: str, time: float = math.nan, call: str = "", author: str = ""
    ) -> ArmWarning:
        """Return the text as a warning."""
        named = not call or text.startswith(call)
        made = super().__new__(cls, text if named else f"{call}: {text}")
        made.time, made.author = time, author
        return made
