"""Following a ramp: TRACK against streamed positions of version 1."""

from __future__ import annotations

from benchmarks.arm import ready
from benchmarks.measure import Row
from bioscara.drivers import Setpoint, track
from bioscara.errors import BioscaraError

SPEED = 0.314
ACCELERATION = 1.57
PERIOD = 0.02
SECONDS = 4.0


def steady_error(*, v1: bool) -> float:
    """Return the steady error of J1 on a ramp [rad]: commanded minus reported position."""
    arm, (joint,) = ready(v1=v1, names=("j1",))
    joint.set_max_acceleration(ACCELERATION)
    start = joint.get_position() + 0.005
    begin = due = arm.now()
    errors = []
    while (now := arm.now()) - begin < SECONDS:
        ahead = 0.0 if v1 else PERIOD
        (sample,) = track([joint], [Setpoint(start + SPEED * (now - begin + ahead), SPEED)])
        if isinstance(sample, BioscaraError):
            raise sample
        if now - begin > SECONDS / 2 and sample.position is not None:
            errors.append(start + SPEED * (sample.stamp - begin) - sample.position)
        due += PERIOD
        arm.clock.sleep_until(due)
    return sum(errors) / len(errors)


def rows() -> list[Row]:
    """Measure both, side by side."""
    smooth, lagging = abs(steady_error(v1=False)), abs(steady_error(v1=True))
    law = SPEED**2 / (2 * ACCELERATION) + SPEED * PERIOD
    what = f"ramp of {SPEED} rad/s on J1 at 50 Hz, limit {ACCELERATION} rad/s^2"
    return [
        Row(
            f"{what}: TRACK",
            f"{1e3 * smooth:.2f} mrad steady error",
            f"version 1: {1e3 * lagging:.1f} mrad",
            "at most 2 mrad",
            smooth <= 2e-3,
        ),
        Row(
            f"{what}: positions of version 1",
            f"{1e3 * lagging:.1f} mrad steady error",
            f"law v^2/(2a) + v T: {1e3 * law:.1f} mrad",
            "within 20 % of the law",
            abs(lagging / law - 1.0) <= 0.2,
        ),
    ]
