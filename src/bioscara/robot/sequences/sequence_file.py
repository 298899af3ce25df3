"""The file of a sequence: YAML of a fixed schema, always complete.

    schema: 1
    title: plate to reader
    tool: fingers
    steps:
    - {kind: move_named, name: above_plate, velocity_scaling: 0.5}
    - kind: move_linear
      pose: {x: 0.0, y: 0.05, z: 0.011, yaw: 0.0}
      frame: bench
      velocity_scaling: 0.3
    - {kind: move_gripper, width: 0.08}
    - {kind: wait, seconds: 0.5}
    ...

The last line is part of the schema: a truncated file would often still be a shorter sequence.
"""

from __future__ import annotations

import io
import json
from pathlib import Path

from bioscara.errors import ConfigurationError
from bioscara.files.whole_files import replacing
from bioscara.model.yaml_file import SIZE_MAX, YamlFile, read_text
from bioscara.robot.sequences.steps import SCHEMA, StepSequence, values_of

_HEADING = """\
# Steps of an arm: 'bioscara run FILE'. Metres, radians, seconds; scalings are shares of the limits.
# The file may be edited, and ends with '...'.
"""


def read_sequence(path: Path | str) -> StepSequence:
    """Return the sequence in a file.

    Args:
        path: The file.

    Raises:
        ConfigurationError: The file cannot be read, is truncated or of another schema, or
            anything in it is unknown, missing or not possible; the message names the line.
    """
    return sequence_of_text(read_text(Path(path), str(path)), str(path))


def sequence_of_text(text: str, source: str) -> StepSequence:
    """Return the sequence in the text of a file.

    Args:
        text: The text.
        source: Name of the file in errors.

    Raises:
        ConfigurationError: As :func:`read_sequence`.
    """
    if len(text) > SIZE_MAX:
        raise ConfigurationError(f"{source}: is larger than {SIZE_MAX // 2**20} MiB; split it")
    file = YamlFile(text, source)
    file.check_version("schema", SCHEMA)
    if not f"\n{text}".rstrip().endswith("\n..."):
        raise ConfigurationError(
            f"{source}, line {text.count(chr(10)) + 1}: the file is truncated: it does not end "
            "with a line '...'; if it is whole, add that line"
        )
    if isinstance(file.values, dict) and "schema" not in file.values:
        raise ConfigurationError(f"{source}, line 1: schema is missing; begin with 'schema: 1'")
    return StepSequence.checked(file.values, file.place)


def is_sequence(path: Path | str) -> bool:
    """Return whether a file has the top level of a sequence; False if it cannot be read."""
    try:
        with Path(path).open("rb") as file:
            data = b"\n" + file.read(SIZE_MAX)
    except OSError:
        return False
    return b"\nsteps:" in data


def text_of_sequence(sequence: StepSequence) -> str:
    """Return a sequence as the text of a file; reading it gives the same sequence."""
    # Imported here: only writing needs the library.
    from ruamel.yaml import YAML  # noqa: PLC0415

    yaml = YAML(typ="safe", pure=True)
    yaml.explicit_end, yaml.width = True, 10_000
    # Of the unprintable characters, some would be read as the ends of lines.
    yaml.allow_unicode = json.dumps(values := values_of(sequence), ensure_ascii=False).isprintable()
    yaml.representer.sort_base_mapping_type_on_output = False
    stream = io.StringIO()
    yaml.dump(values, stream)
    return _HEADING + stream.getvalue()


def write_sequence(path: Path | str, sequence: StepSequence) -> None:
    """Write a sequence to a file atomically.

    Raises:
        ConfigurationError: The file cannot be written.
    """
    try:
        with replacing(Path(path)) as partial:
            partial.write_text(text_of_sequence(sequence), encoding="utf-8")
    except OSError as error:
        raise ConfigurationError(
            f"{path}: the sequence cannot be saved ({error.strerror or error}); name another file"
        ) from error
