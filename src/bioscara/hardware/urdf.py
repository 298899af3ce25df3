"""A robot description, parsed; errors name the line.

The XML is plain: no entities, no document types, no large files.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from bioscara.errors import ConfigurationError

SIZE_MAX = 4_000_000
"""Largest file that is read [bytes]: some hundred times a description of this arm."""


class Urdf:
    """A parsed robot description.

    Args:
        text: The XML.
        source: Name of the source in messages.

    Attributes:
        root: The ``<robot>`` element.

    Raises:
        ConfigurationError: It is not XML of the plain kind, too large, or no robot.
    """

    def __init__(self, text: str, source: str) -> None:
        self._source = source
        self._lines: dict[Element, int] = {}
        if len(text) > SIZE_MAX:
            raise ConfigurationError(
                f"{source}: {len(text)} characters; a robot description has at most {SIZE_MAX}"
            )
        self.root = self._parse(text)
        if self.root.tag != "robot":
            raise self.error(self.root, f"<{self.root.tag}> is not <robot>: this is no URDF")

    @classmethod
    def load(cls, path: Path | str) -> Urdf:
        """Read a file.

        Raises:
            ConfigurationError: It cannot be read, and as above.
        """
        try:
            with Path(path).open("rb") as file:
                content = file.read(SIZE_MAX + 1)
            return cls(content.decode(), str(path))
        except OSError as error:
            raise ConfigurationError(f"{path}: {error.strerror or error}") from error
        except UnicodeDecodeError as error:
            raise ConfigurationError(f"{path}: not a text file: {error}") from error

    def error(self, element: Element, text: str) -> ConfigurationError:
        """Return an error that states the location of ``element``."""
        return ConfigurationError(f"{self.place(element)}{text}")

    def place(self, element: Element) -> str:
        """Return the begin of a message about ``element``."""
        return f"{self._source}, line {self._lines[element]}: "

    def attribute(self, element: Element, name: str) -> str:
        """Return an attribute.

        Raises:
            ConfigurationError: The element has none of that name, or it is empty.
        """
        value = element.attrib.get(name, "").strip()
        if not value:
            raise self.error(element, f"<{element.tag}> has no {name}")
        return value

    def _parse(self, text: str) -> Element:
        builder = TreeBuilder()
        parser = expat.ParserCreate()
        parser.buffer_text = True

        def start(tag: str, attributes: Mapping[str, str]) -> None:
            self._lines[builder.start(tag, dict(attributes))] = parser.CurrentLineNumber

        def refuse(*_: object) -> None:
            raise ConfigurationError(
                f"{self._source}, line {parser.CurrentLineNumber}: a robot description has no "
                "document type and no entities; remove <!DOCTYPE ...>"
            )

        parser.StartElementHandler = start
        parser.EndElementHandler = builder.end
        parser.CharacterDataHandler = builder.data
        parser.StartDoctypeDeclHandler = refuse
        parser.EntityDeclHandler = refuse
        try:
            parser.Parse(text, True)
        except expat.ExpatError as error:
            raise ConfigurationError(
                f"{self._source}, line {error.lineno}: not XML: {expat.ErrorString(error.code)}"
            ) from error
        except UnicodeEncodeError as error:
            raise ConfigurationError(f"{self._source}: not a text: {error}") from error
        return builder.close()
