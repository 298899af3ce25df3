"""Generate the page's kinds of steps of a sequence, from the declarations of the tasks.

``make generate`` writes the file, ``make fresh`` compares it.
"""

from __future__ import annotations

import json
import sys
from typing import Any

import msgspec

from bioscara.planning.motions.waypoints import MOST_BLEND
from bioscara.robot.sequences.steps import KINDS, PATHS
from bioscara.robot.tasks.checks import metadata
from bioscara.robot.tasks.forms import JointForm, LoadForm, PoseForm
from tools.generated import ROOT, main, update

FILE = ROOT / "src/bioscara/dashboard/page/js/teach/step_kinds.js"
_HEAD = """\
// Generated from src/bioscara/robot/tasks by `make generate`: the kinds of steps and their fields.

/**
 * A field of a step: type, unit, range, whether it has to be given, and its default.
 *
 * @typedef {Object} StepField
 * @property {"pose" | "positions" | "load" | "name" | "share" | "number"} type
 * @property {string} [unit]
 * @property {number} [minimum]
 * @property {number} [maximum]
 * @property {boolean} [required]
 * @property {number | null} [usual]
 */

/** The fields of each kind, by name. @type {Record<string, Record<string, StepField>>} */
export const STEP_KINDS = """
_FORMS = {PoseForm: "pose", JointForm: "positions", LoadForm: "load"}


def content() -> str:
    """Return the text of the file."""
    lines = ["{"]
    for name, kind in KINDS.items():
        fields = {each.name: _field(each) for each in sorted(_fields(kind), key=_is_share)}
        if kind in PATHS:
            fields["blend"] = {"type": "number", "unit": "m", "minimum": 0, "maximum": MOST_BLEND}
            fields["blend"]["usual"] = 0
        lines.append(f"  {name}: {{")
        lines += [f"    {field}: {_literal(values)}," for field, values in fields.items()]
        lines.append("  },")
    return _HEAD + "\n".join([*lines, "};", ""])


def _fields(kind: type[msgspec.Struct]) -> tuple[msgspec.structs.FieldInfo, ...]:
    return msgspec.structs.fields(kind)


def _is_share(field: msgspec.structs.FieldInfo) -> bool:
    return field.name.endswith("_scaling")


def _field(field: msgspec.structs.FieldInfo) -> dict[str, Any]:
    extra, limits = metadata(field.type), _schema(field)
    values: dict[str, Any] = {"type": _FORMS.get(extra.get("form"), "")}
    if not values["type"]:
        values["type"] = "share" if _is_share(field) else "number" if limits else "name"
    if "x-unit" in limits:
        values["unit"] = limits["x-unit"]
    values |= {key: limits[key] for key in ("minimum", "maximum") if key in limits}
    if field.required:
        values["required"] = True
    elif limits:
        values["usual"] = field.default
    return values


def _schema(field: msgspec.structs.FieldInfo) -> dict[str, Any]:
    """Return range and unit of a field, as in the JSON Schema."""
    holder = msgspec.defstruct("Holder", [(field.name, field.type)])
    found: dict[str, Any] = msgspec.json.schema_components([holder])[1]["Holder"]["properties"]
    schema = found[field.name]
    # Those of a value that may be left out are within the union with null.
    inner = [schema, *schema.get("anyOf", ())]
    return next((each for each in inner if "minimum" in each), {})


def _literal(values: dict[str, Any]) -> str:
    pairs = ", ".join(f"{key}: {json.dumps(value)}" for key, value in values.items())
    return f"{{ {pairs} }}"


if __name__ == "__main__":
    sys.exit(main(lambda check: update({FILE: content()}, check=check)))
