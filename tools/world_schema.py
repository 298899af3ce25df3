"""Generate ``docs/world.schema.json``: the JSON Schema of world files, for editors.

``make generate`` writes the file, ``make fresh`` compares it. It is of draft 7, which editors read.
"""

from __future__ import annotations

import json
import sys
import typing
from dataclasses import MISSING, fields
from types import UnionType
from typing import Any

from bioscara.model.labware import labware_table
from bioscara.model.validation import Checked, Restricted, Within
from bioscara.planning.files.scene_file import WORLD_VERSION
from bioscara.planning.world.world_file import Piece, WorldFile
from tools.api_reference import documented
from tools.generated import ROOT, main, update

SCHEMA = ROOT / "docs/world.schema.json"
_PLAIN = {
    float: "number",
    int: "integer",
    str: "string",
    bool: "boolean",
    type(None): "null",
}


class _Definitions:
    """Collects the schemas of groups of values."""

    def __init__(self) -> None:
        self.schemas: dict[str, Any] = {}

    def of(self, kind: Any) -> dict[str, Any]:
        """Return the schema of a type."""
        origin, inner = typing.get_origin(kind), typing.get_args(kind)
        if origin is typing.Annotated:
            schema = self.of(inner[0])
            for note in inner[1:]:
                schema |= _bounds(note)
        elif origin is typing.Literal:
            schema = {"enum": [*inner]}
        elif origin in {UnionType, typing.Union}:
            schema = {"anyOf": [self.of(each) for each in inner]}
        elif origin is tuple and inner[1:] == (...,):
            schema = {"type": "array", "items": self.of(inner[0])}
        elif origin is tuple:
            items, count = [self.of(each) for each in inner], len(inner)
            schema = {"type": "array", "items": items, "minItems": count, "maxItems": count}
        elif kind in _PLAIN:
            schema = {"type": _PLAIN[kind]}
        else:
            schema = self._group(kind)
        return schema

    def _group(self, kind: type[Checked]) -> dict[str, Any]:
        name = kind.__name__.lstrip("_")
        if name not in self.schemas:
            hints = typing.get_type_hints(kind, include_extras=True)
            text, attributes = documented(kind)
            group: dict[str, Any] = {"type": "object", "description": text, "properties": {}}
            self.schemas[name] = group
            for each in fields(kind):
                about = attributes.get(each.name)
                described = {"description": about} if about else {}
                group["properties"][each.name] = self.of(hints[each.name]) | described
            group["required"] = [each.name for each in fields(kind) if each.default is MISSING]
            group["additionalProperties"] = False
            if issubclass(kind, Piece):
                _place_once(group)
        return {"$ref": f"#/definitions/{name}"}


def _bounds(note: object) -> dict[str, Any]:
    """Return what a note of an annotation says."""
    if isinstance(note, Within):
        return {"minimum": note.lower, "maximum": note.upper}
    if isinstance(note, Restricted) and note.pattern:
        # Of a whole text, here as there.
        return {"pattern": f"^(?:{note.pattern})$"}
    return {}


def _place_once(group: dict[str, Any]) -> None:
    """Require either what labware stands on or its place; offer the kinds that are known."""
    group["oneOf"] = [{"required": ["place"]}, {"required": ["x", "y", "z"]}]
    kind = group["properties"]["kind"]
    kind["anyOf"] = [{"enum": [*labware_table()]}, {"description": "one of labware_files"}]


def schema() -> str:
    """Return the JSON Schema of world files."""
    definitions = _Definitions()
    definitions.of(WorldFile)
    whole = definitions.schemas.pop(WorldFile.__name__)
    whole["properties"]["version"] = {"const": WORLD_VERSION, "description": "Of the format."}
    head = {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": f"World of a bioscara arm, version {WORLD_VERSION}",
    }
    whole["definitions"] = dict(sorted(definitions.schemas.items()))
    return json.dumps({**head, **whole}, indent=1) + "\n"


if __name__ == "__main__":
    sys.exit(main(lambda check: update({SCHEMA: schema()}, check=check)))
