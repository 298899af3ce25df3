"""An arm in a process of its own that publishes its true state: ``observed_arm.py SOCKET [homed]``.

The bus has one host at a time, and an observer on it would take time from that host. So the process
writes where the joints really are, and how they really move, into a file next to the socket.
"""

from __future__ import annotations

import mmap
import os
import signal
import struct
import sys
import time
from pathlib import Path

from bioscara import Robot
from bioscara.model import load_parameters
from bioscara.sim import FirmwareBus, SimulatedArm, serve
from bioscara.sim.simulated_arm import JOINTS
from simulated import NEAR

START = (-2.0, 0.25, 1.5, 1.5)
_TRUTH = struct.Struct(f"<{2 * len(JOINTS)}d{len(JOINTS)}?")


def truth(socket: Path) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return positions and velocities of the joints of the arm behind ``socket``, now."""
    values = _values(socket)
    return values[: len(JOINTS)], values[len(JOINTS) : 2 * len(JOINTS)]


def energised(socket: Path) -> list[str]:
    """Return the joints of the arm behind ``socket`` in whose motors current flows."""
    return [name for name, on in zip(JOINTS, _values(socket)[-len(JOINTS) :], strict=True) if on]


def at_rest(socket: Path) -> bool:
    """Return whether no joint moves faster than 1 mm/s or 1 mrad/s for 0.1 s."""
    return all(abs(speed) < 1e-3 for _ in range(20) for speed in truth(socket)[1])


def _values(socket: Path) -> tuple[float, ...]:
    # An observer that polls all the time would take the processor from the host.
    time.sleep(0.005)
    return _TRUTH.unpack(_file(socket).read_bytes())


def _file(socket: Path) -> Path:
    return socket.with_suffix(".truth")


def main() -> None:
    ended: list[int] = []
    signal.signal(signal.SIGTERM, lambda number, _: ended.append(number))
    socket = Path(sys.argv[1])
    if "homed" in sys.argv:
        arm = SimulatedArm(positions=NEAR)
        with Robot(FirmwareBus(arm), arm.clock, load_parameters(), "homing") as robot:
            robot.home()
            robot.move_joints(START)
    else:
        arm = SimulatedArm()
    _file(socket).write_bytes(bytes(_TRUTH.size))
    with _file(socket).open("r+b") as file, mmap.mmap(file.fileno(), _TRUTH.size) as shown:

        def show() -> bool:
            shown[:] = _TRUTH.pack(
                *map(arm.position, JOINTS), *map(arm.velocity, JOINTS), *map(arm.has_torque, JOINTS)
            )
            return bool(ended)

        def listening() -> None:
            os.write(sys.stdout.fileno(), b"listening\n")

        show()
        serve(arm, socket, show, listening=listening)


if __name__ == "__main__":
    main()
