"""Position errors that a joint captures autonomously, at the rate of its control tick."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from bioscara.clock import Clock
from bioscara.drivers.joint.transmission import MICROSTEPS_PER_RAD
from bioscara.drivers.link.session import Session
from bioscara.errors import IncorrectStateError
from bioscara.protocol import Register
from bioscara.protocol.registers import BLOCK_SAMPLES, CAPTURE_PERIOD, CAPTURE_SAMPLES

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_LIMIT = 2.0 * CAPTURE_SAMPLES * CAPTURE_PERIOD
"""Time in which a capture that was begun is complete [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class Capture:
    """Position errors of a joint in successive control ticks.

    Attributes:
        errors: Angle from the rotor to the field in each tick [rad of the motor]; 0 while the motor
            has no current. The rotor is that of the encoder, whose own error is up to 1 degree.
        period: Time between two of them [s].
    """

    errors: NDArray[np.float64]
    period: float


def read(session: Session, clock: Clock, joint: str) -> Capture:
    """Return the capture that was begun last, when it is complete.

    Each block of it is requested by its number, so that a repeated exchange answers the same one.

    Raises:
        IncorrectStateError: It is not complete in time, as none was begun.
    """
    # Imported here: most programs with joints need no arrays.
    import numpy as np  # noqa: PLC0415

    end = clock.now() + _LIMIT
    while missing := CAPTURE_SAMPLES - int(session.read(Register.CAPTURE).values[0]):
        if clock.now() > end:
            raise IncorrectStateError(
                f"{joint}: {missing} of {CAPTURE_SAMPLES} errors are not captured",
                joint,
                "start_capture() first",
            )
        clock.sleep_until(clock.now() + missing * CAPTURE_PERIOD)
    errors: list[float] = []
    for block in range(-(-CAPTURE_SAMPLES // BLOCK_SAMPLES)):
        errors += session.write(Register.CAPTUREBLOCK, block).values
    return Capture(np.array(errors[:CAPTURE_SAMPLES]) / MICROSTEPS_PER_RAD, CAPTURE_PERIOD)
