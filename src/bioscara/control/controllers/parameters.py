"""Parameters of controllers: strict, with the field's names and defaults."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator
from pydantic_core import PydanticCustomError

from bioscara.errors import ConfigurationError
from bioscara.model.parameters import HIGHEST_RATE
from bioscara.spelling import did_you_mean

Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Rate = Annotated[int, Field(ge=0, le=HIGHEST_RATE)]
_UNKNOWN = "unknown_name"


class ParameterGroup(BaseModel):
    """Base of all parameter groups: unknown names and infinity are refused."""

    PER_JOINT: ClassVar[bool] = False
    """Whether a section for each joint, under the joint's name, is allowed next to the others."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _refuse_unknown(cls, values: object) -> object:
        """Refuse an unknown name here, where the known names are available for a hint."""
        known = cls.model_fields
        for name, value in values.items() if isinstance(values, Mapping) else ():
            if name in known or (cls.PER_JOINT and isinstance(value, Mapping | ParameterGroup)):
                continue
            more = ", and a section for each joint" if cls.PER_JOINT else ""
            hint = did_you_mean(str(name), known, f"it has {', '.join(known)}{more}")
            raise PydanticCustomError(_UNKNOWN, "{hint}", {"name": name, "hint": hint})
        return values


class Parameters(ParameterGroup):
    """Base of every controller's parameters; names and defaults are those of ros2_controllers.

    Attributes:
        update_rate: Updates per second [Hz]; 0 for every cycle.
        fallback_controllers: Controllers that take over when this one fails.
    """

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
            if first["type"] == _UNKNOWN:
                where = ".".join(map(str, (*first["loc"], first["ctx"]["name"])))
                raise ConfigurationError(
                    f"{controller}: unknown parameter {where}; {first['msg']}"
                ) from error
            if first["type"] == "missing":
                raise ConfigurationError(f"{controller}: parameter {where} is missing") from error
            raise ConfigurationError(
                f"{controller}: parameter {where} = {first['input']!r}: {first['msg']}"
            ) from error
