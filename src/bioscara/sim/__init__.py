"""The simulated arm: the joints' own firmware behind a bus. Bytes go in, bytes come out.

``arm`` is the thing itself, with its time, its world and the faults one can put into it;
``firmware_bus`` is the bus to it within this process; ``server`` lets it live in a process of its
own, and ``socket_bus`` is the bus to that, in the bytes of ``framing``. ``servo`` is what the
gripper's pulses go to.
"""

from bioscara.sim.arm import SimulatedArm as SimulatedArm
from bioscara.sim.firmware_bus import FirmwareBus as FirmwareBus
from bioscara.sim.server import serve as serve
from bioscara.sim.servo import SimulatedServo as SimulatedServo
from bioscara.sim.socket_bus import SocketBus as SocketBus
