"""Parameters of controllers: strict, with the field's names and defaults."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from typing import Annotated, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from bioscara.errors import ConfigurationError

Rate = Annotated[int, Field(ge=0, le=100_000)]


class Parameters(BaseModel):
    """Base of every controller's parameters; names and defaults are those of ros2_controllers.

    Attributes:
        update_rate: Updates per second [Hz]; 0 for every cycle.
        fallback_controllers: Controllers that take over when this one fails.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    update_rate: Rate = 0
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
        try:
            return cls.model_validate(values)
        except ValidationError as error:
            first = error.errors()[0]
            where = ".".join(map(str, first["loc"]))
            if first["type"] == "extra_forbidden":
                known = [*cls.model_fields]
                near = difflib.get_close_matches(str(first["loc"][-1]), known, 1)
                hint = f"did you mean {near[0]}?" if near else f"it has {', '.join(known)}"
                raise ConfigurationError(
                    f"{controller}: unknown parameter {where}; {hint}"
                ) from error
            if first["type"] == "missing":
                raise ConfigurationError(f"{controller}: parameter {where} is missing") from error
            raise ConfigurationError(
                f"{controller}: parameter {where} = {first['input']!r}: {first['msg']}"
            ) from error
