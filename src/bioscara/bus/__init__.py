"""Buses: they carry transactions and return the bytes read, or the error of each transaction.

``bus`` is the interface; then one file per kind of bus: ``linux`` the real one (``diagnosis``
explains its errors, ``user`` names the program that has it), ``tracing`` writes and replays a
``trace``, ``faults`` corrupts transactions by ``injection``. ``select`` opens one by its name.
A bus knows addresses and bytes, never registers or joints.
"""

from bioscara.bus.bus import ADDRESSES as ADDRESSES, Bus as Bus, Transaction as Transaction
from bioscara.bus.faults import FaultyBus as FaultyBus
from bioscara.bus.injection import Direction as Direction, Injection as Injection, When as When
from bioscara.bus.linux import LinuxBus as LinuxBus
from bioscara.bus.select import FORMS as FORMS, open_bus as open_bus
from bioscara.bus.trace import TraceRecord as TraceRecord, read_trace as read_trace
from bioscara.bus.tracing import ReplayBus as ReplayBus, TracingBus as TracingBus
