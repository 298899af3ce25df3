"""Generate the types of the messages for the programs of the dashboard, from the structs.

``make generate`` writes the file, ``make fresh`` compares it.
"""

from __future__ import annotations

import json
import sys
from typing import Any

import msgspec

from bioscara.api import messages
from tools.generated import ROOT, main, update

FILE = ROOT / "src/bioscara/dashboard/page/messages.d.ts"
_HEAD = (
    "// Generated from src/bioscara/api/messages.py by `make generate`: the messages of an owner, "
    "as JSON.\n"
)
_UNIONS = ("FromClient", "AnyCommand", "AnyTask", "Motion", "FromOwner", "AnyResult")
_INPUTS = ("FromClient", "AnyCommand")
"""Unions of messages of a client: there a field with a default may be left out."""


def content() -> str:
    """Return the text of the file."""
    kinds = [getattr(messages, union) for union in _UNIONS]
    roots, definitions = msgspec.json.schema_components(kinds, ref_template="{name}")
    parts = [_HEAD]
    for union, root in zip(_UNIONS, roots, strict=True):
        parts.append(f"export type {union} = {_type(root)};\n")
    sent = _reached(roots[: len(_UNIONS)], definitions)
    for name, schema in sorted(definitions.items()):
        parts.append(_definition(name, schema, name in sent))
    return "\n".join(parts)


def _reached(roots: Any, definitions: dict[str, Any]) -> set[str]:
    """Return the names of the types in a client's messages."""
    found: set[str] = set()
    waiting = [root for union, root in zip(_UNIONS, roots, strict=True) if union in _INPUTS]
    while waiting:
        for name in _references(waiting.pop()) - found:
            found.add(name)
            waiting.append(definitions[name])
    return found


def _references(schema: Any) -> set[str]:
    if isinstance(schema, dict):
        found = {schema["$ref"]} if isinstance(schema.get("$ref"), str) else set()
        return found.union(*map(_references, schema.values()))
    if isinstance(schema, list):
        return set().union(*map(_references, schema))
    return set()


def _definition(name: str, schema: dict[str, Any], sent: bool) -> str:
    if schema.get("type") != "object":
        return f"export type {name} = {_type(schema)};\n"
    required = set(schema.get("required", ()))
    lines = []
    for field, kind in schema.get("properties", {}).items():
        optional = "?" if sent and field not in required and field != "kind" else ""
        lines.append(f"  {field}{optional}: {_type(kind)};")
    return "\n".join([f"export interface {name} {{", *lines, "}\n"])


def _type(schema: dict[str, Any]) -> str:  # noqa: PLR0911  a case each
    if "$ref" in schema:
        return str(schema["$ref"])
    if "enum" in schema:
        return " | ".join(map(json.dumps, schema["enum"]))
    if "anyOf" in schema:
        return " | ".join(_type(each) for each in schema["anyOf"])
    match schema.get("type"):
        case "number":
            # JSON has neither NaN nor infinity: they are null.
            return "number | null" if schema.get("default", 0) is None else "number"
        case "integer":
            return "number"
        case "string":
            return "string"
        case "boolean":
            return "boolean"
        case "null":
            return "null"
        case "array" if "prefixItems" in schema:
            return f"[{', '.join(map(_type, schema['prefixItems']))}]"
        case "array":
            inner = _type(schema.get("items", {}))
            return f"({inner})[]" if "|" in inner else f"{inner}[]"
        case "object" if "additionalProperties" in schema:
            return f"Record<string, {_type(schema['additionalProperties'])}>"
    return "any"


if __name__ == "__main__":
    sys.exit(main(lambda check: update({FILE: content()}, check=check)))
