"""Simulated arm: the joints' own firmware behind a bus that carries bytes.

``simulated_arm`` is the arm with its time, its surroundings and the faults that can be injected;
``firmware_bus`` is the bus to it within this process, ``bench`` one with faults that a person can
switch on; ``server`` runs it in a separate process, and
``socket_bus`` is the bus to that process, with the frames of ``framing``. ``onlooker`` reads that
arm's positions without using it. ``servo`` simulates the gripper's servo, in
a temporary folder of ``files``.
"""

from bioscara.sim.bench import Bench as Bench, BenchBus as BenchBus
from bioscara.sim.firmware_bus import FirmwareBus as FirmwareBus
from bioscara.sim.onlooker import Onlooker as Onlooker
from bioscara.sim.server import pwm_folder as pwm_folder, serve as serve
from bioscara.sim.servo import SimulatedServo as SimulatedServo
from bioscara.sim.simulated_arm import SimulatedArm as SimulatedArm
from bioscara.sim.socket_bus import SocketBus as SocketBus
