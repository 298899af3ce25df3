"""Text from outside as people and terminals may see it."""

from __future__ import annotations


def printable(text: str) -> str:
    """Return a text with what is not printable escaped, as Python writes it.

    Names of files, joints and zones may hold line ends and control sequences of a terminal, which
    could forge lines of a report or change what the terminal shows.
    """
    if text.isprintable():
        return text
    return "".join(
        character
        if character.isprintable()
        else character.encode("unicode_escape", "surrogatepass").decode("ascii")
        for character in text
    )
