"""One control cycle of four joints: the time of the host, and the time of the bus."""

from __future__ import annotations

from benchmarks.arm import ready
from benchmarks.floors import exchange
from benchmarks.measure import Row, at_most, medians
from bioscara.drivers import Joint, Setpoint, track
from bioscara.protocol import TRAILER, WRITE, Register
from bioscara.sim import SimulatedArm
from bioscara.sim.simulated_arm import OVERHEAD

CYCLES = 3000


def _setpoints(joints: list[Joint]) -> list[Setpoint]:
    return [Setpoint(joint.parameters.home_position * 0.999, 0.0) for joint in joints]


def _bus_time(arm: SimulatedArm, joints: list[Joint], frequency: float) -> tuple[float, float]:
    """Return the duration of a cycle on the simulated bus, and that of its frames [s]."""
    start = arm.now()
    track(joints, _setpoints(joints))
    taken = arm.now() - start
    message = WRITE[Register.TRACKLOAD]
    written, read = message.request_size - 1 + TRAILER, message.answer_size + TRAILER
    bits = 30 + 9 * written + 9 * read
    return taken, len(joints) * (bits / frequency + OVERHEAD[frequency])


def rows() -> list[Row]:
    """Measure the host's share with no bus time, and the whole cycle at both bus speeds."""
    _, joints = ready(frequency=None)
    setpoints = _setpoints(joints)
    cost, floor = medians(lambda: track(joints, setpoints), exchange(), rounds=CYCLES)
    what = "host's share: check, encode, one bus call, decode"
    result = [at_most(what, cost, 5, floor, "bare pack, call, unpack")]
    for frequency in (100e3, 400e3):
        arm, joints = ready(frequency=frequency)
        taken, needed = _bus_time(arm, joints, frequency)
        ratio = taken / needed
        result.append(
            Row(
                f"whole cycle at {frequency / 1e3:.0f} kHz, with the load of each joint",
                f"{1e3 * taken:.3f} ms",
                f"bits of its frames and overhead: {1e3 * needed:.3f} ms",
                "at most 1.05 times",
                ratio <= 1.05,
            )
        )
    return result
