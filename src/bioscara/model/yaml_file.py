"""Values of a YAML file, with their lines."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from bioscara.arguments import shown
from bioscara.errors import ConfigurationError
from bioscara.model.validation import Location, described

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


class YamlFile:
    """The values of a YAML file, and their lines.

    Args:
        text: Its text.
        source: Name of the file in errors.

    Attributes:
        values: Content of the text; for ``Checked.checked``.

    Raises:
        ConfigurationError: It is no YAML, or larger than the bounds above.
    """

    def __init__(self, text: str, source: str) -> None:
        self._source = source
        self.values = _parsed(text, source)

    @classmethod
    def load(cls, path: Path, source: str) -> YamlFile:
        """Read a file; arguments and errors as :func:`read_text` and above."""
        return cls(read_text(path, source), source)

    def check_version(self, key: str, *versions: int) -> None:
        """Raise if the file is of another version, whose names may differ.

        Args:
            key: Name of the value that is the version.
            versions: The versions that are read.

        Raises:
            ConfigurationError: It has a whole number that is none of ``versions`` there.
        """
        found = self.values.get(key) if isinstance(self.values, dict) else None
        if type(found) is not bool and isinstance(found, int) and found not in versions:
            raise ConfigurationError(
                f"{self.place((key,))}{key}: {described(found)} cannot be read; this version of "
                f"bioscara reads {' and '.join(map(str, versions))}; use the one that wrote the "
                "file"
            )

    def at(self, location: Location) -> object:
        """Return a value; None if it is not there."""
        node = self.values
        for key in location:
            if not (isinstance(node, dict) and key in node):
                return None
            node = node[key]
        return node

    def place(self, location: Location) -> str:
        """Return the begin of a message about a value: the file, and the value's line.

        A value that is not there has the line of its group.
        """
        node, line = self.values, 1
        for key in location:
            lines: Any = getattr(node, "lc", None)
            if isinstance(node, dict) and key in node:
                # A value merged here (<<) is written elsewhere; it has no line of its own.
                line = (lines.data or {}).get(key, (line - 1,))[0] + 1
            elif isinstance(node, list) and isinstance(key, int) and key < len(node):
                line = lines.item(key)[0] + 1
            else:
                break
            node = node[key]
        return f"{self._source}, line {line}: "


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


def _parsed(text: str, source: str) -> Any:
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
        return yaml.load(text)
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
