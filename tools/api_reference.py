"""Generate ``docs/api.md`` and ``docs/api.schema.json``: the messages of an owner.

``make generate`` writes the files, ``make fresh`` compares them.
"""

from __future__ import annotations

import inspect
import json
import re
import sys
import typing
from typing import Any

import msgspec

from bioscara.api import messages
from tools.generated import ROOT, main, update

PAGE, SCHEMA = ROOT / "docs/api.md", ROOT / "docs/api.schema.json"

_HEAD = """# Messages of an owner

Generated from `src/bioscara/api/messages.py` by `make generate`; [the JSON Schema](api.schema.json)
has the same. Version {version}. [The owner and its clients](server.md) explains their use.

Every message on the Unix socket is four bytes with its length, highest first, and then msgpack; or
JSON, if the first message of the client is JSON. A message is a map whose `kind` names it.
{summary}
"""
_GROUPS = (
    ("From a client", "FromClient"),
    ("Commands, one in each request", "AnyCommand"),
    ("Tasks, one for each goal", "AnyTask"),
    ("From the owner", "FromOwner"),
    ("Results, one in each response", "AnyResult"),
)
_VALUES = "Values within messages"


def page() -> str:
    """Return the text of the page."""
    summary = " ".join((messages.__doc__ or "").split("\n\n", 2)[2].split())
    parts = [_HEAD.format(version=messages.VERSION, summary=_plain(summary))]
    shown: set[str] = set()
    for title, union in _GROUPS:
        parts.append(f"## {title}\n")
        for kind in typing.get_args(getattr(messages, union)):
            if kind.__name__ not in shown:
                shown.add(kind.__name__)
                parts.append(_entry(kind))
    parts.append(f"## {_VALUES}\n")
    for kind in vars(messages).values():
        if (
            inspect.isclass(kind)
            and issubclass(kind, messages.Value)
            and kind is not messages.Value
        ):
            parts.append(_entry(kind))
    return "\n".join(parts)


def schema() -> str:
    """Return the JSON Schema of the messages."""
    roots = [messages.FromClient, messages.FromOwner]
    (client, owner), definitions = msgspec.json.schema_components(
        roots, ref_template="#/$defs/{name}"
    )
    for definition in definitions.values():
        # Python 3.13 removes the indentation of docstrings, those before do not.
        if "description" in definition:
            definition["description"] = inspect.cleandoc(definition["description"])
    whole = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": f"Messages of an owner, version {messages.VERSION}",
        "anyOf": [client, owner],
        "$defs": dict(sorted(definitions.items())),
    }
    return json.dumps(whole, indent=1) + "\n"


def _entry(kind: type[Any]) -> str:
    text, attributes = documented(kind)
    config = kind.__struct_config__
    name = f"`{config.tag}`" if config.tag is not None else f"`{kind.__name__}`"
    lines = [f"### {name}\n", text, ""]
    rows = []
    for field in msgspec.structs.fields(kind):
        default = "" if field.required else _default(field)
        rows.append(
            f"| `{field.name}` | {_type(field.type)} | {default} | "
            f"{attributes.get(field.name, '')} |"
        )
    if rows:
        lines += ["| field | type | default | |", "| --- | --- | --- | --- |", *rows, ""]
    return "\n".join(lines)


def documented(kind: type[Any]) -> tuple[str, dict[str, str]]:
    """Return the description of a message, and those of its fields."""
    attributes: dict[str, str] = {}
    for each in reversed(kind.__mro__):
        _, _, listed = inspect.cleandoc(each.__doc__ or "").partition("Attributes:\n")
        for name, said in re.findall(
            r"^    (\w+): ((?:.*\n?)(?:^ {8}.*\n?)*)", listed, re.MULTILINE
        ):
            attributes[name] = _plain(" ".join(said.split())).replace("|", "\\|")
    text, _, _ = inspect.cleandoc(kind.__doc__ or "").partition("Attributes:\n")
    return _plain(text.strip()), attributes


def _plain(text: str) -> str:
    """Return a docstring as Markdown."""
    text = re.sub(r":(?:class|data):`~?([\w.]+)`", lambda found: f"`{_name(found[1])}`", text)
    return text.replace("``", "`")


def _name(name: str) -> str:
    """Return the name of a class in messages: its kind, if it has one."""
    config = getattr(getattr(messages, name, None), "__struct_config__", None)
    return name if config is None or config.tag is None else str(config.tag)


def _default(field: msgspec.structs.FieldInfo) -> str:
    if field.default_factory is not msgspec.NODEFAULT:
        return f"`{json.dumps(field.default_factory())}`"
    value = field.default
    if isinstance(value, float) and value != value:  # noqa: PLR0124  NaN
        return "NaN"
    return f"`{json.dumps(value)}`"


def _type(kind: Any) -> str:  # noqa: PLR0911  a case each
    """Return a type in words of JSON."""
    simple = {
        float: "number",
        int: "integer",
        str: "string",
        bytes: "bytes",
        bool: "boolean",
        type(None): "null",
    }
    if kind in simple:
        return simple[kind]
    origin, inner = typing.get_origin(kind), typing.get_args(kind)
    if origin is typing.Annotated:
        said = inner[1].extra_json_schema or {}
        if "minimum" not in said:
            return _type(inner[0])
        limits = f"{said['minimum']:.4g} .. {said['maximum']:.4g} {said.get('x-unit', '')}"
        return f"{_type(inner[0])}, {limits}".rstrip()
    if origin is tuple:
        if len(inner) == 2 and inner[1] is Ellipsis:
            return f"array of {_type(inner[0])}"
        return "array of " + ", ".join(map(_type, inner))
    if origin is dict:
        return "object"
    if origin is typing.Literal:
        return " or ".join(f'`"{each}"`' for each in inner)
    if inner:
        names = [
            f"any of {each}"
            for each in ("AnyTask", "AnyCommand", "AnyResult", "Motion")
            if set(inner) == set(typing.get_args(getattr(messages, each)))
        ]
        return _TITLES[names[0]] if names else " or ".join(map(_type, inner))
    if hasattr(kind, "__struct_config__") and kind.__struct_config__.tag is not None:
        return f"`{kind.__struct_config__.tag}`"
    return f"`{getattr(kind, '__name__', kind)}`"


_TITLES = {
    "any of AnyTask": "a task",
    "any of AnyCommand": "a command",
    "any of AnyResult": "a result",
    "any of Motion": "a task that moves and can be planned",
}


if __name__ == "__main__":
    sys.exit(main(lambda check: update({PAGE: page(), SCHEMA: schema()}, check=check)))
