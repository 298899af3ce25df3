"""The arm behind every bus of the contract: the compiled firmware, in virtual time."""

from __future__ import annotations

from bioscara.bus import Bus


def open_arm() -> Bus:
    """Return a bus with four joints, just switched on."""
    # Half of this folder runs without the native simulation and must be collected without it.
    from bioscara.sim import FirmwareBus  # noqa: PLC0415

    return FirmwareBus()
