"""The parameters of the arm, with the overlay that the command line or the environment names."""

from __future__ import annotations

import os

from bioscara.arguments import OVERLAY_VARIABLE
from bioscara.cli.output.console import Output
from bioscara.cli.parser import Options
from bioscara.errors import ConfigurationError
from bioscara.model import ArmParameters, load_parameters
from bioscara.model.overlay import changes


def parameters_from(options: Options) -> ArmParameters:
    """Return the parameters of the arm; print which values its overlay changes, if it has one.

    Those of a served arm are its owner's.

    Raises:
        ConfigurationError: The overlay cannot be read or used; names file, line and value.
        OwnerLostError: No owner of the arm runs.
    """
    if options.arm is not None:
        # Imported here: to plan needs no robot.
        from bioscara.cli.owner_link import served_robot  # noqa: PLC0415

        options.parameters = None
        with served_robot(options) as robot:
            return robot.parameters
    try:
        parameters = load_parameters(overlay=options.parameters)
    except ConfigurationError as error:
        if str(options.parameters) == os.environ.get(OVERLAY_VARIABLE):
            error.add_note(f"{options.parameters} is named by ${OVERLAY_VARIABLE}")
        raise
    for note in overlay_notes(options, parameters):
        Output().line(note)
    return parameters


def overlay_notes(options: Options, parameters: ArmParameters) -> tuple[str, ...]:
    """Return a line with the values that the overlay changes; nothing without an overlay."""
    if options.parameters is None:
        return ()
    changed = "; ".join(map(str, changes(load_parameters(), parameters)))
    return (f"parameters: {options.parameters} changes {changed or 'nothing'}",)
