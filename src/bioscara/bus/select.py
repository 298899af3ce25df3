"""Opening of a bus by its name on the command line."""

from __future__ import annotations

from collections.abc import Sequence

from bioscara.arguments import shown
from bioscara.bus.bus import Bus
from bioscara.bus.linux import LinuxBus
from bioscara.errors import InvalidArgumentError

FORMS = ("linux:1 (number of the I2C bus)", "linux:/dev/i2c-1 (path of its device)")
"""Forms of the names accepted by :func:`open_bus`, for messages and help."""


def open_bus(name: str, other_forms: Sequence[str] = ()) -> Bus:
    """Return the bus of this name; it opens its device at the first transfer.

    Args:
        name: ``linux:NUMBER`` or ``linux:PATH``.
        other_forms: Further forms that the caller handles, for the message.

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
