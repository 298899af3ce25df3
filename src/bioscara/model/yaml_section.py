"""Sections of a YAML file; every error states its line."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from bioscara.arguments import shown
from bioscara.errors import ConfigurationError
from bioscara.model.section import Section

SIZE_MAX = 2**20
"""Largest file that is read [bytes]; the arm's own has a hundredth of it."""
LINES_MAX, LINE_MAX = 20_000, 10_000
"""Most lines of a file, and most characters of one."""
NODES_MAX, DEPTH_MAX, ALIASES_MAX = 6000, 20, 100
"""Most names, values and collections of a file, its deepest nesting and most uses of its anchors.
The parser takes 120 us for each, so less than a second for all; a taught pose has 26 of them."""
_UNMARKED = (
    ValueError, LookupError, AttributeError, TypeError, OverflowError,
    AssertionError, NotImplementedError,
)  # fmt: skip
"""Errors that the parser does not convert: impossible values, such as a thirteenth
month, and comments where it expects none."""


class YamlSection(Section):
    """One mapping of a file.

    Args:
        source: Name of the file.
        where: Dotted path of the mapping; empty for the whole file.
        node: The parsed mapping.
        line: Line in which it begins.

    Raises:
        ConfigurationError: It is no mapping.
    """

    def __init__(self, source: str, where: str, node: Any, line: int) -> None:
        self._source, self._where, self._line = source, where, line
        if not isinstance(node, dict):
            raise self.error(f"{where or 'the file'} must be a mapping of names to values")
        self._node: Any = node

    def error(self, text: str, key: str | None = None) -> ConfigurationError:
        """Return an error that states the location of the value of ``key``."""
        line = self._line if key is None else self._line_of(key)
        return ConfigurationError(f"{self._source}, line {line}: {text}")

    def name(self, key: str) -> str:
        """Return the name of the value in the file."""
        return f"{self._where}.{key}" if self._where else key

    def keys(self) -> Iterable[str]:
        """Return the keys of this section of the file."""
        return tuple(self._node)

    def value(self, key: str) -> Any:
        """Return the value as written in the file.

        Raises:
            ConfigurationError: There is none.
        """
        if key not in self._node:
            raise self.error(f"{self.name(key)} is missing")
        return self._node[key]

    def section(self, key: str) -> YamlSection:
        """Return the mapping at ``key``.

        Raises:
            ConfigurationError: There is none.
        """
        node = self.value(key)
        return YamlSection(self._source, self.name(key), node, self._line_of(key))

    def sections(self, key: str) -> list[YamlSection]:
        """Return the mappings of the list at ``key``.

        Raises:
            ConfigurationError: There is no list, it is empty, or an item is no mapping.
        """
        nodes = self.value(key)
        if not isinstance(nodes, list) or not nodes:
            raise self.error(f"{self.name(key)} must be a list of mappings", key)
        lines: Any = getattr(nodes, "lc", None)
        return [
            YamlSection(self._source, f"{self.name(key)}[{i}]", node, lines.item(i)[0] + 1)
            for i, node in enumerate(nodes)
        ]

    def _line_of(self, key: str) -> int:
        # A value merged here (<<) is written elsewhere; it has no line of its own.
        known = (self._node.lc.data or {}).get(key)
        return known[0] + 1 if known else self._line


def read_text(path: Path, source: str) -> str:
    """Return the text of a file.

    Args:
        path: The file.
        source: Name of the source in errors.

    Raises:
        ConfigurationError: It cannot be read, is too large or is no text.
    """
    try:
        with path.open("rb") as file:
            data = file.read(SIZE_MAX + 1)
    except OSError as error:
        raise ConfigurationError(f"{source}: {error.strerror or error}") from error
    if len(data) > SIZE_MAX:
        raise ConfigurationError(f"{source}: is larger than {SIZE_MAX // 2**20} MiB; split it")
    try:
        return data.decode()
    except UnicodeDecodeError as error:
        raise ConfigurationError(
            f"{source}: not a text file: byte {error.start} is not UTF-8"
        ) from error


def sections_of(text: str, source: str) -> YamlSection:
    """Return the mapping of a YAML text.

    Args:
        text: The text.
        source: Name of the source in errors.

    Raises:
        ConfigurationError: It is no YAML, no mapping, or larger than the bounds above.
    """
    _check_lines(text, source)
    # Imported only when a file is read, since the parser loads slowly.
    from ruamel.yaml import YAML  # noqa: PLC0415
    from ruamel.yaml.composer import Composer, ComposerError  # noqa: PLC0415
    from ruamel.yaml.constructor import ConstructorError, RoundTripConstructor  # noqa: PLC0415
    from ruamel.yaml.error import MarkedYAMLError, YAMLError  # noqa: PLC0415
    from ruamel.yaml.events import AliasEvent  # noqa: PLC0415
    from ruamel.yaml.reader import ReaderError  # noqa: PLC0415

    class Located(RoundTripConstructor):
        def construct_object(self, node: Any, deep: bool = False) -> Any:
            try:
                return super().construct_object(node, deep)
            except _UNMARKED as error:
                raise ConstructorError(None, None, str(error), node.start_mark) from error

    class Bounded(Composer):
        nodes = depth = aliases = 0

        def compose_node(self, parent: Any, index: Any) -> Any:
            self.nodes += 1
            self.depth += 1
            self.aliases += self.parser.check_event(AliasEvent)
            for count, most, what in (
                (self.nodes, NODES_MAX, "names and values in a file"),
                (self.depth, DEPTH_MAX, "levels of nesting"),
                (self.aliases, ALIASES_MAX, "uses of anchors in a file"),
            ):
                if count > most:
                    mark = self.parser.peek_event().start_mark
                    raise ComposerError(None, None, f"more than {most} {what}", mark)
            node = super().compose_node(parent, index)
            self.depth -= 1
            return node

    yaml = YAML(typ="rt")
    yaml.Constructor, yaml.Composer = Located, Bounded
    try:
        node = yaml.load(text)
    except MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 1
        raise ConfigurationError(f"{source}, line {line}: {error.problem}") from error
    except ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        raise ConfigurationError(f"{source}, line {line}: {error.reason}") from error
    except (YAMLError, *_UNMARKED) as error:
        raise ConfigurationError(f"{source}: not a YAML file: {shown(error)}") from error
    except RecursionError:
        raise ConfigurationError(f"{source}: is nested too deeply") from None
    return YamlSection(source, "", node, 1)


def _check_lines(text: str, source: str) -> None:
    lines = text.splitlines()
    if len(lines) > LINES_MAX:
        raise ConfigurationError(
            f"{source}: {len(lines)} lines, more than {LINES_MAX} are not read; split the file"
        )
    for number, line in enumerate(lines, 1):
        if len(line) > LINE_MAX:
            raise ConfigurationError(
                f"{source}, line {number}: {len(line)} characters, at most {LINE_MAX} are read"
            )


def read_sections(path: Path, source: str) -> YamlSection:
    """Return the mapping of a YAML file; arguments and errors as the two above."""
    return sections_of(read_text(path, source), source)
