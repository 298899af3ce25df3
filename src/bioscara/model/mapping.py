"""Mappings of a YAML file, whose every complaint names file and line."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from bioscara.errors import ConfigurationError
from bioscara.model.checks import Section


class Mapping(Section):
    """One mapping of the file."""

    def __init__(self, source: str, where: str, node: Any, line: int) -> None:
        self._source, self._where, self._line = source, where, line
        if not isinstance(node, dict):
            raise self.error(f"{where or 'the file'} must be a mapping of names to values")
        self._node: Any = node

    def error(self, text: str, key: str | None = None) -> ConfigurationError:
        """Return an error that says where the value of ``key`` stands."""
        line = self._line
        if key is not None and key in self._node:
            line = self._node.lc.key(key)[0] + 1
        return ConfigurationError(f"{self._source}, line {line}: {text}")

    def name(self, key: str) -> str:
        """Return what the file calls the value."""
        return f"{self._where}.{key}" if self._where else key

    def keys(self) -> Iterable[str]:
        """Return the keys that the file has here."""
        return tuple(self._node)

    def value(self, key: str) -> Any:
        """Return the value as it stands in the file.

        Raises:
            ConfigurationError: There is none.
        """
        if key not in self._node:
            raise self.error(f"{self.name(key)} is missing")
        return self._node[key]

    def section(self, key: str) -> Mapping:
        """Return the mapping below a key.

        Raises:
            ConfigurationError: It is missing or not a mapping.
        """
        node = self.value(key)
        return Mapping(self._source, self.name(key), node, self._node.lc.key(key)[0] + 1)

    def sections(self, key: str) -> list[Mapping]:
        """Return the list of mappings below a key.

        Raises:
            ConfigurationError: It is missing, empty, or not such a list.
        """
        nodes = self.value(key)
        if not isinstance(nodes, list) or not nodes:
            raise self.error(f"{self.name(key)} must be a list of mappings", key)
        lines: Any = getattr(nodes, "lc", None)
        return [
            Mapping(self._source, f"{self.name(key)}[{i}]", node, lines.item(i)[0] + 1)
            for i, node in enumerate(nodes)
        ]


def read_mapping(path: Path, source: str) -> Mapping:
    """Return what a YAML file holds.

    Args:
        path: The file.
        source: What complaints call it.

    Raises:
        ConfigurationError: It cannot be read, or is not a mapping in YAML.
    """
    # Only who reads a file pays for the parser.
    from ruamel.yaml import YAML  # noqa: PLC0415
    from ruamel.yaml.error import MarkedYAMLError, YAMLError  # noqa: PLC0415

    try:
        node = YAML(typ="rt").load(path.read_bytes().decode())
    except OSError as error:
        raise ConfigurationError(f"{source}: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise ConfigurationError(f"{source}: not a text file: {error}") from error
    except MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 1
        raise ConfigurationError(f"{source}, line {line}: {error.problem}") from error
    except YAMLError as error:
        raise ConfigurationError(f"{source}: not a YAML file: {error}") from error
    return Mapping(source, "", node, 1)
