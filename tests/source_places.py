"""Places in the sources by qualified name, and changes to them by tokens instead of exact text.

A place is the end of a dotted name such as ``control.limits.limiter.Limiter.apply``: as much of it
as distinguishes it from others. ``Limiter.apply`` is a function, ``Limiter`` a class, ``limiter`` a
module and ``limiter.LIMIT`` a constant; in C++ likewise with ``::``. Layout and comments are not
part of it.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
FOLDERS = ("src/bioscara", "firmware/joint/src/core", "firmware/joint/boards", "firmware/sim")
_STRING = r"'''.*?'''|\"\"\".*?\"\"\"|'(?:\\.|[^'\\\n])*'|\"(?:\\.|[^\"\\\n])*\""
_WORD = r"\w+|[^\s\w]"
_TOKENS = {
    ".py": re.compile(rf"#[^\n]*|(?P<token>{_STRING}|{_WORD})", re.DOTALL),
    ".cpp": re.compile(rf"//[^\n]*|/\*.*?\*/|(?P<token>{_STRING}|{_WORD})", re.DOTALL),
}


class Token(NamedTuple):
    """A token and where it is in its file."""

    text: str
    start: int
    end: int


class Region(NamedTuple):
    """A named part of a file."""

    name: str
    file: Path
    start: int
    end: int


class Change(NamedTuple):
    """A file and its text after a change."""

    file: Path
    text: str


def apply(place: str, old: str, new: str) -> Change:
    """Replace the one occurrence of ``old`` in a place.

    Args:
        place: Name of a function, a class or a module; several may have it.
        old: The text to replace, which must occur in them exactly once.
        new: The replacement.

    Raises:
        LookupError: No such place, or ``old`` does not occur in it exactly once.
    """
    regions = [region for region in _regions() if _ends_with(region.name, place)]
    if not regions:
        raise LookupError(f"there is no {place}")
    found = {(region.file, *span) for region in regions for span in occurrences(region, old)}
    if len(found) != 1:
        raise LookupError(f"{old!r} occurs {len(found)} times in {place}")
    ((file, start, end),) = found
    text = file.read_text()
    return Change(file, text[:start] + new + text[end:])


def occurrences(region: Region, old: str) -> Iterator[tuple[int, int]]:
    """Return start and end of each occurrence of the tokens of ``old`` in a region."""
    wanted = [token.text for token in tokens(old, region.file.suffix)]
    there = [token for token in _tokens_of(region.file) if region.start <= token.start < region.end]
    for first in range(len(there) - len(wanted) + 1):
        part = there[first : first + len(wanted)]
        if [token.text for token in part] == wanted:
            yield part[0].start, part[-1].end


def tokens(text: str, suffix: str) -> list[Token]:
    """Return the tokens of a source text, without comments."""
    return [
        Token(match["token"], *match.span())
        for match in _TOKENS[suffix].finditer(text)
        if match["token"]
    ]


@cache
def _tokens_of(file: Path) -> list[Token]:
    return tokens(file.read_text(), file.suffix)


def _ends_with(name: str, place: str) -> bool:
    return f".{name}".endswith("." + place.replace("::", "."))


@cache
def _regions() -> list[Region]:
    regions = []
    for folder in FOLDERS:
        for file in sorted((ROOT / folder).rglob("*")):
            if file.suffix in _TOKENS:
                module = ".".join(file.relative_to(ROOT).with_suffix("").parts)
                regions.append(Region(module, file, 0, len(file.read_text())))
                parts = _python(file) if file.suffix == ".py" else _cpp(file)
                regions += [part._replace(name=f"{module}.{part.name}") for part in parts]
    return regions


def _python(file: Path) -> Iterator[Region]:
    text = file.read_text()
    lines = [0]
    for line in text.encode().splitlines(keepends=True):
        lines.append(lines[-1] + len(line.decode()))

    def walk(node: ast.AST, prefix: str) -> Iterator[Region]:
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
                first = min([child.lineno, *(each.lineno for each in child.decorator_list)])
                assert child.end_lineno is not None
                yield Region(prefix + child.name, file, lines[first - 1], lines[child.end_lineno])
                yield from walk(child, f"{prefix}{child.name}.")
            elif isinstance(child, ast.Assign | ast.AnnAssign) and not prefix:
                target = child.targets[0] if isinstance(child, ast.Assign) else child.target
                if isinstance(target, ast.Name):
                    assert child.end_lineno is not None
                    start, end = (lines[line] for line in (child.lineno - 1, child.end_lineno))
                    yield Region(target.id, file, start, end)
            else:
                yield from walk(child, prefix)

    return walk(ast.parse(text), "")


def _cpp(file: Path) -> Iterator[Region]:
    """Return classes and functions: blocks whose head has a name, or a name and parentheses."""
    scopes: list[tuple[str, int]] = []  # names of the open blocks; "" for one without
    head: list[Token] = []
    for token in _tokens_of(file):
        if token.text == "{":
            inside = any("(" in name for name, _ in scopes)
            scopes.append(("" if inside else _name(head), (head or [token])[0].start))
            head = []
        elif token.text == "}":
            name, start = scopes.pop()
            if name:
                outer = [each for each, _ in scopes if each]
                yield Region(".".join([*outer, name.rstrip("(")]), file, start, token.end)
            head = []
        elif token.text == ";":
            head = []
        else:
            head.append(token)


def _name(head: list[Token]) -> str:
    """Return the name of a class, or that of a function with a ``(`` at its end; or nothing."""
    text = " ".join(token.text for token in head)
    words = re.sub(r"__attribute__ \( \( [^()]*(\( [^()]* \) )?\) \)", "", text).split(" ")
    if "namespace" in words or "enum" in words:
        return ""
    if "(" in words and "=" not in words[: words.index("(")]:
        end = words.index("(")
        begin = end - 1
        while begin >= 2 and words[begin - 1] == words[begin - 2] == ":":
            begin -= 3
        return ".".join(word for word in words[begin:end] if word != ":") + "("
    for kind in ("class", "struct"):
        if kind in words[:-1]:
            return words[words.index(kind) + 1]
    return ""
