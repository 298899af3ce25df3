"""Generate ``model/existing_arms.py``: the values of ``parameters.yaml`` as a module.

``make generate`` writes the file, ``make fresh`` compares it. Programs that use these values
then need neither the YAML parser nor the checks, which both load slowly.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import fields
from pathlib import Path

from bioscara.errors import ConfigurationError
from bioscara.model import existing_arms, load_parameters
from bioscara.model.loading import EXISTING_ARMS, checksum
from bioscara.model.validation import Checked

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
        values = {each.name: _literal(getattr(value, each.name), deeper) for each in fields(value)}
        lines = "".join(f"{deeper}{name}={text},\n" for name, text in values.items())
        return f"{type(value).__name__}.unchecked(\n{lines}{indent})"
    if isinstance(value, tuple):
        lines = "".join(f"{deeper}{_literal(each, deeper)},\n" for each in value)
        return f"(\n{lines}{indent})"
    return repr(value)


def main(arguments: list[str] | None = None) -> int:
    """Write or check the module; return the exit status."""
    parser = argparse.ArgumentParser(description="Generate the module of the committed parameters.")
    parser.add_argument("--check", action="store_true", help="write nothing, fail when stale")
    options = parser.parse_args(arguments)
    module = Path(existing_arms.__file__)
    try:
        text = render(EXISTING_ARMS)
    except ConfigurationError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    if module.read_text() == text:
        return 0
    if options.check:
        sys.stderr.write(f"{module.name}: stale; run make generate\n")
        return 1
    module.write_text(text)
    sys.stdout.write(f"wrote {module.name}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
