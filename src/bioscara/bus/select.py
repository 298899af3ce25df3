"""A bus by its name, as the command line spells it."""

from __future__ import annotations

from collections.abc import Sequence

from bioscara.arguments import shown
from bioscara.bus.bus import Bus
from bioscara.bus.linux import LinuxBus
from bioscara.errors import InvalidArgumentError

FORMS = ("linux:1 (number of the I2C bus)", "linux:/dev/i2c-1 (path of its device)")
"""The names that :func:`open_bus` takes, for messages and help."""


def open_bus(name: str, other_forms: Sequence[str] = ()) -> Bus:
    """Return the bus of this name; it opens its device at the first transfer.

    Args:
        name: ``linux:NUMBER`` or ``linux:PATH``.
        other_forms: Forms that the caller understands itself, for the message.

    Raises:
        InvalidArgumentError: The name has none of the forms.
    """
    kind, _, where = name.partition(":")
    if kind == "linux":
        if where.isascii() and where.isdecimal():
            return LinuxBus(int(where))
        if where.startswith("/"):
            return LinuxBus(where)
    forms = ", ".join((*other_forms, *FORMS))
    raise InvalidArgumentError(f"no bus is named {shown(name)}; a bus is one of: {forms}")
