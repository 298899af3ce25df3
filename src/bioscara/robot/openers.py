"""How arms of other processes are found, by the prefix of their names: ``arm`` of ``arm:NAME``."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from bioscara.robot.arm_methods import ArmMethods


class ConnectOptions(NamedTuple):
    """What is needed to connect to an arm of another process.

    Attributes:
        timeout: Longest time to wait for it [s].
        token: Token of a gateway; None for none.
        ca_file: Certificates of the authorities that are trusted; None for the system's.
        fingerprint: Fingerprint of the certificate that is trusted; None for authorities.
    """

    timeout: float = 0.0
    token: str | None = None
    ca_file: Path | str | None = None
    fingerprint: str | None = None

    @property
    def of_gateway(self) -> tuple[str, ...]:
        """The names of the given options that only a gateway takes."""
        return tuple(
            name for name in ("token", "ca_file", "fingerprint") if getattr(self, name) is not None
        )


Opener = Callable[[str, ConnectOptions], ArmMethods]
"""Returns the robot of a name."""

OPENERS: dict[str, Opener] = {}
"""The openers; :mod:`bioscara.connect`, which is above robots and their clients, adds them."""
