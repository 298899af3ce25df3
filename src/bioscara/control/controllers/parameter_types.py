"""Parameters of controllers: strict, with the field's names and defaults."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Self

from bioscara.model.parameters import HIGHEST_RATE
from bioscara.model.validation import Checked, Within


class Parameters(Checked):
    """Base of every controller's parameters; names and defaults are those of ros2_controllers.

    Attributes:
        update_rate: Updates per second [Hz]; 0 for every cycle.
        fallback_controllers: Controllers that take over when this one fails.
    """

    update_rate: Annotated[int, Within(0, HIGHEST_RATE, "Hz")] = 0
    fallback_controllers: tuple[str, ...] = ()

    @classmethod
    def read(cls, controller: str, values: Mapping[str, object]) -> Self:
        """Return the checked parameters.

        Args:
            controller: Name of the controller, for messages.
            values: As in the controller's section of a parameter file.

        Raises:
            ConfigurationError: A name is unknown, or a value cannot be used; names both.
        """
        return cls.checked(values, lambda _: f"{controller}: ")
