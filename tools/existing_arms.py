"""Generate ``model/existing_arms.py``: the values of ``parameters.yaml`` as a module.

``make generate`` writes the file, ``make fresh`` compares it. Programs that use these values
then need neither the YAML parser nor the checks, which both load slowly.
"""

from __future__ import annotations

import json
import sys
from dataclasses import fields
from pathlib import Path

from bioscara.model import existing_arms, load_parameters
from bioscara.model.loading import EXISTING_ARMS, checksum
from bioscara.model.validation import Checked
from tools import generated

_ROOM = 80
"""Longest value on a line [characters]; its name is before it."""
_MODULE = '''"""The checked values of parameters.yaml; generated from it by make generate."""

from __future__ import annotations

from bioscara.model.parameters import (
{names}
)

CHECKSUM = {checksum:_}
"""Checksum of the file."""


def parameters() -> ArmParameters:
    """Return the parameters in the file."""
    return {value}
'''


def render(source: Path) -> str:
    """Return the text of the module.

    Args:
        source: The parameter file.

    Raises:
        ConfigurationError: It cannot be read, or a value cannot be used.
    """
    parameters = load_parameters(source)
    names = "\n".join(f"    {name}," for name in sorted(_groups(parameters)))
    value = _literal(parameters, "    ")
    return _MODULE.format(names=names, checksum=checksum(source), value=value)


def _groups(value: object) -> set[str]:
    """Return the names of the groups that a value is made of."""
    if isinstance(value, tuple):
        return set().union(*map(_groups, value))
    if not isinstance(value, Checked):
        return set()
    inner = (_groups(getattr(value, each.name)) for each in fields(value))
    return {type(value).__name__}.union(*inner)


def _literal(value: object, indent: str) -> str:
    """Return the expression of a value, formatted as the rest of the source."""
    if isinstance(value, str):
        return json.dumps(value)
    deeper = f"{indent}    "
    if isinstance(value, Checked):
        begin = f"{type(value).__name__}.unchecked("
        given = ((each.name, getattr(value, each.name)) for each in fields(value))
        parts = [f"{name}={_literal(each, deeper)}" for name, each in given]
    elif isinstance(value, tuple):
        begin, parts = "(", [_literal(each, deeper) for each in value]
    else:
        return repr(value)
    line = f"{begin}{', '.join(parts)})"
    if len(parts) > 1 and "\n" not in line and len(deeper + line) <= _ROOM:
        return line
    lines = "".join(f"{deeper}{part},\n" for part in parts)
    return f"{begin}\n{lines}{indent})"


def main(arguments: list[str] | None = None) -> int:
    """Write or check the module; return the exit status."""
    module = Path(existing_arms.__file__)
    return generated.main(
        lambda check: generated.update({module: render(EXISTING_ARMS)}, check=check), arguments
    )


if __name__ == "__main__":
    sys.exit(main())
