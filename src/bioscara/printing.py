"""Safe display of text from outside."""

from __future__ import annotations

LONGEST = 1000
"""Characters of the longest error text, which may repeat a name of any length."""
_LEFT_OUT = " ... "
_TAIL = 400
"""Characters at its end that are kept: they have the remedy."""


def printable(text: str) -> str:
    """Return a text with unprintable characters escaped, as in Python's ``repr``.

    Names of files, joints and zones may hold line ends and control sequences of a terminal, which
    could forge lines of a report or change the terminal's display.
    """
    if text.isprintable():
        return text
    return "".join(
        character
        if character.isprintable()
        else character.encode("unicode_escape", "surrogatepass").decode("ascii")
        for character in text
    )


def encodable(text: str) -> str:
    """Return a text with escapes for what UTF-8 cannot encode, as in other names of files."""
    return text.encode(errors="backslashreplace").decode()


def brief(text: str) -> str:
    """Return an error text for display: printable, and without its middle where it is too long."""
    # Cut before it is escaped, too, as that takes a moment for each character.
    shown = printable(shortened(text))
    return shortened(shown)


def shortened(text: str) -> str:
    """Return a text without its middle where it is longer than the longest error text."""
    if len(text) <= LONGEST:
        return text
    return text[: LONGEST - _TAIL - len(_LEFT_OUT)] + _LEFT_OUT + text[-_TAIL:]
