"""Safe display of text from outside."""

from __future__ import annotations


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
