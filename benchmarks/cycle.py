"""One control cycle of four joints: the time of the host, and the time of the bus."""

from __future__ import annotations

import statistics
import struct

from benchmarks.arm import ready
from benchmarks.measure import Row, timings
from bioscara.bus import Bus, Transaction
from bioscara.drivers import Joint, Setpoint, track
from bioscara.protocol import TRAILER, WRITE, Register
from bioscara.sim import SimulatedArm
from bioscara.sim.arm import OVERHEAD

CYCLES = 3000


def _setpoints(joints: list[Joint]) -> list[Setpoint]:
    return [Setpoint(joint.parameters.home_position * 0.999, 0.0) for joint in joints]


class _Echo(Bus):
    """A minimal bus within this process."""

    def transfer(self, transactions):  # type: ignore[no-untyped-def]
        return [bytes(item.read) for item in transactions]

    def close(self) -> None:
        pass


def _floor() -> float:
    """Return the time of packing, one call and unpacking for four joints in plain floats [s]."""
    out, back, bus = struct.Struct("<Bfh"), struct.Struct("<fhB"), _Echo()
    scales = ((35.0, 0.1), (-1570.8, 0.02), (24.0, 0.3), (12.0, 0.4))

    def cycle() -> None:
        frames = [
            Transaction(0x11, out.pack(0xD5, 0.5 * scale + offset, 1), 7)
            for scale, offset in scales
        ]
        for data, (scale, offset) in zip(bus.transfer(frames), scales, strict=True):
            angle, _, _ = back.unpack(data)
            (angle - offset) / scale

    return statistics.median(timings(cycle, CYCLES))


def _bus_time(arm: SimulatedArm, joints: list[Joint], frequency: float) -> tuple[float, float]:
    """Return the duration of a cycle on the simulated bus, and that of its frames [s]."""
    start = arm.now()
    track(joints, _setpoints(joints))
    taken = arm.now() - start
    message = WRITE[Register.TRACK]
    written, read = message.request_size - 1 + TRAILER, message.answer_size + TRAILER
    bits = 30 + 9 * written + 9 * read
    return taken, len(joints) * (bits / frequency + OVERHEAD[frequency])


def rows() -> list[Row]:
    """Measure the host's share with no bus time, and the whole cycle at both bus speeds."""
    floor = _floor()
    _, joints = ready(frequency=None)
    setpoints = _setpoints(joints)
    cost = statistics.median(timings(lambda: track(joints, setpoints), CYCLES))
    result = [
        Row(
            "host's share: check, encode, one bus call, decode",
            f"{1e6 * cost:.1f} us",
            f"bare pack, call, unpack: {1e6 * floor:.1f} us ({cost / floor:.1f} times)",
            "at most 5 times",
            cost / floor <= 5.0,
        )
    ]
    for frequency in (100e3, 400e3):
        arm, joints = ready(frequency=frequency)
        taken, needed = _bus_time(arm, joints, frequency)
        ratio = taken / needed
        result.append(
            Row(
                f"whole cycle at {frequency / 1e3:.0f} kHz",
                f"{1e3 * taken:.3f} ms",
                f"bits of its frames and overhead: {1e3 * needed:.3f} ms",
                "at most 1.05 times",
                ratio <= 1.05,
            )
        )
    return result
