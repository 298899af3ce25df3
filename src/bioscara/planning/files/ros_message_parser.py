"""Parser for the YAML of ROS 2 messages: fields and lists, in blocks or in brackets.

A deliberate subset of YAML. Features that messages never use (tags, anchors, multi-line texts) are
refused with their line, and words remain strings: the caller converts numbers. A general YAML
parser takes ten times as long, and interprets text that was not written as a number as one, in
files that set an arm in motion.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple, TypeAlias

from bioscara.arguments import shown
from bioscara.errors import TrajectoryError

DEPTH_MAX = 16
"""Deepest nesting that is read; a moveit_msgs/DisplayTrajectory has 8 levels."""

ITEMS_MAX = 100_000
"""Longest list that is read, hence the most points of a trajectory."""

FULL_LENGTH = "write the file with `ros2 topic echo --full-length`"
"""Remedy for lists shortened by ``ros2 topic echo``, which it does from 128 items on."""

Node: TypeAlias = "str | list[Node] | dict[str, Node] | None"

_KEY = re.compile(r"([A-Za-z_][A-Za-z0-9_]*) *:(?: +|$)")
_QUOTED = re.compile(r"""'((?:[^']|'')*)'|"([^"\\]*)\"""")
_TOKEN = re.compile(
    r""" *(?:(?P<mark>[][{},])"""
    r"""|(?P<key>[A-Za-z_][A-Za-z0-9_]*) *:(?= |$)"""
    r"""|(?P<word>'(?:[^']|'')*'|"[^"\\]*"|[^][{},'"# ][^][{},]*)) *"""
)


class Document(NamedTuple):
    """The first message of a text.

    Attributes:
        value: Its content; None where a field or the whole message is empty.
        unfinished: The lists and sets of fields that only the end of the text terminated, so that
            items may have been cut off.
        more: Whether other messages follow.
    """

    value: Node
    unfinished: tuple[Node, ...]
    more: bool


class _Line(NamedTuple):
    number: int
    column: int
    content: str

    @property
    def is_item(self) -> bool:
        return self.content[0] == "-" and self.content[1:2] in {"", " "}


def first_document(text: str) -> Document:
    """Return the first message of a text.

    Raises:
        TrajectoryError: The text does not have this format; the message names the line.
    """
    lines, ended, more = _lines(text)
    if not lines:
        return Document(None, (), more)
    reader = _Parser(lines)
    value = reader.read()
    # A last line that a bracket closes is whole, and so is the item that it ends.
    ended = ended or (lines[-1].content[-1] in "]}" and text.endswith("\n"))
    return Document(value, () if ended else tuple(reader.unfinished), more)


def _lines(text: str) -> tuple[list[_Line], bool, bool]:
    """Return the lines of the first message, whether an end mark ends it, and whether more follow.

    Empty lines and comments are omitted.
    """
    lines: list[_Line] = []
    ended = False
    for number, raw in enumerate(text.split("\n"), 1):
        line = raw.rstrip(" \t\r")
        content = line.lstrip(" ")
        if not content or content[0] == "#":
            continue
        column = len(line) - len(content)
        if " #" in content:
            content = _without_comment(content, number)
        if content == "---" and column == 0:
            ended = bool(lines)
        elif ended:
            return lines, True, True
        elif line == "...":
            raise _error(number, f"'...' stands for what was left out; {FULL_LENGTH}")
        elif "\t" in content:
            raise _error(number, "tabs have no place in a message; use spaces")
        else:
            lines.append(_Line(number, column, content))
    return lines, ended, False


def _without_comment(content: str, number: int) -> str:
    kept = content[: content.index(" #")].rstrip(" ")
    if "'" in kept or '"' in kept:
        raise _error(number, "'#' in a line with quotes; give the comment a line of its own")
    return kept


def _error(number: int, problem: str) -> TrajectoryError:
    return TrajectoryError(f"line {number}: not readable as a message: {problem}")


class _Token(NamedTuple):
    number: int
    kind: str
    text: str


class _Parser:
    """Reads lines into nodes, from the first line to the last."""

    def __init__(self, lines: list[_Line]) -> None:
        self.unfinished: list[Node] = []
        self._lines = lines
        self._at = 0

    def read(self) -> Node:
        value = self._node(1)
        if self._at < len(self._lines):
            line = self._lines[self._at]
            raise _error(line.number, f"{shown(line.content)} does not belong to the lines above")
        return value

    def _node(self, depth: int) -> Node:
        line = self._lines[self._at]
        if line.is_item:
            return self._items(line.column, _deeper(depth, line.number))
        if _KEY.match(line.content):
            return self._fields(line.column, _deeper(depth, line.number))
        self._at += 1
        return self._value(line.content, line.number, depth)

    def _items(self, column: int, depth: int) -> Node:
        items: list[Node] = []
        while self._at < len(self._lines):
            line = self._lines[self._at]
            if line.column > column:
                raise _error(line.number, f"{shown(line.content)} is indented too far")
            if line.column < column or not line.is_item:
                return items
            _room(items, line.number)
            rest = line.content[1:].lstrip(" ")
            if not rest:
                self._at += 1
                items.append(self._below(column, depth, same=False))
            else:
                inner = line.column + len(line.content) - len(rest)
                self._lines[self._at] = _Line(line.number, inner, rest)
                items.append(self._node(depth))
        self.unfinished.append(items)
        return items

    def _fields(self, column: int, depth: int) -> Node:
        fields: dict[str, Node] = {}
        while self._at < len(self._lines):
            line = self._lines[self._at]
            if line.column < column:
                return fields
            match = _KEY.match(line.content)
            if line.column > column or match is None:
                raise _error(line.number, f"{shown(line.content)} where 'name: value' should stand")
            self._at += 1
            rest = line.content[match.end() :]
            _add(
                fields,
                match[1],
                line.number,
                self._value(rest, line.number, depth)
                if rest
                else self._below(column, depth, same=True),
            )
        self.unfinished.append(fields)
        return fields

    def _below(self, column: int, depth: int, *, same: bool) -> Node:
        """Return the node in the lines below; ``same`` allows a list at the same column."""
        if self._at == len(self._lines):
            return None
        line = self._lines[self._at]
        if line.column > column or (same and line.column == column and line.is_item):
            return self._node(depth)
        return None

    def _value(self, content: str, number: int, depth: int) -> Node:
        if content[0] not in "[{":
            return _word(content, number)
        tokens = self._tokens(content, number)
        value = self._element(tokens, next(tokens), depth)
        last = next(tokens)
        if last.kind != "end":
            raise _error(last.number, f"{shown(last.text)} after the closing bracket")
        return value

    def _tokens(self, content: str, number: int) -> Iterator[_Token]:
        """Yield the tokens of this line and, as long as the caller iterates, of those below."""
        while True:
            at = 0
            while at < len(content):
                match = _TOKEN.match(content, at)
                if match is None:
                    raise _error(number, f"{shown(content[at:])} is not understood")
                at = match.end()
                kind = match.lastgroup or ""
                yield _Token(number, kind, match[kind].rstrip(" "))
            yield _Token(number, "end", "")
            if self._at == len(self._lines):
                raise _error(number, "a bracket is not closed; is the file truncated?")
            number, _, content = self._lines[self._at]
            self._at += 1

    def _element(self, tokens: Iterator[_Token], first: _Token, depth: int) -> Node:
        if first.kind == "word":
            return _word(first.text, first.number)
        inside = (token for token in tokens if token.kind != "end")
        if first.text == "[":
            return self._list(inside, _deeper(depth, first.number))
        if first.text == "{":
            return self._set(inside, _deeper(depth, first.number))
        raise _error(first.number, f"{shown(first.text)} where a value should stand")

    def _list(self, tokens: Iterator[_Token], depth: int) -> Node:
        items: list[Node] = []
        token = next(tokens)
        while token.text != "]":
            _room(items, token.number)
            items.append(self._element(tokens, token, depth))
            token = _after_element(tokens, "]")
        return items

    def _set(self, tokens: Iterator[_Token], depth: int) -> Node:
        fields: dict[str, Node] = {}
        token = next(tokens)
        while token.text != "}":
            if token.kind != "key":
                raise _error(token.number, f"{shown(token.text)} where 'name: value' should stand")
            _add(fields, token.text, token.number, self._element(tokens, next(tokens), depth))
            token = _after_element(tokens, "}")
        return fields


def _after_element(tokens: Iterator[_Token], closing: str) -> _Token:
    """Return the closing bracket, or the token after the comma."""
    token = next(tokens)
    if token.text == ",":
        return next(tokens)
    if token.text != closing:
        raise _error(
            token.number, f"{shown(token.text)} where ',' or {shown(closing)} should stand"
        )
    return token


def _room(items: list[Node], number: int) -> None:
    if len(items) == ITEMS_MAX:
        raise _error(number, f"a list of more than {ITEMS_MAX} items; split the file")


def _deeper(depth: int, number: int) -> int:
    if depth > DEPTH_MAX:
        raise _error(number, f"nested more than {DEPTH_MAX} deep")
    return depth + 1


def _add(fields: dict[str, Node], key: str, number: int, value: Node) -> None:
    if key in fields:
        raise _error(number, f"{shown(key)} stands twice")
    fields[key] = value


def _word(content: str, number: int) -> str:
    if content[0] in "'\"":
        match = _QUOTED.fullmatch(content)
        if match is None:
            raise _error(number, f"{content} is not one quoted word")
        return match[2] if match[1] is None else match[1].replace("''", "'")
    if content[0] in "!&*":
        raise _error(number, "aliases and tags have no place in a message")
    odd = content[0] in "|>%@`?,]}:" or content == "-" or content.startswith("- ")
    if odd or ": " in content or content[-1] == ":":
        raise _error(number, f"{shown(content)} is not understood")
    return content
