"""Warnings of an arm: what stopped nothing, and a person should see all the same."""

from __future__ import annotations

import math


class ArmWarning(str):
    """The text of a warning, which begins with the call that it concerns.

    Args:
        text: What happened.
        time: When it happened [s], on the arm's clock.
        call: The call that it concerns, for example ``"home()"``; empty for none.

    Attributes:
        time: As given; NaN if it is not known.
    """

    time: float

    def __new__(cls, text: str, time: float = math.nan, call: str = "") -> ArmWarning:
        """Return the text as a warning."""
        named = not call or text.startswith(call)
        made = super().__new__(cls, text if named else f"{call}: {text}")
        made.time = time
        return made
