"""Ports: transactions go in, the bytes read (or the error of that transaction) come out.

``Bus`` is the interface; one file per kind of bus. A bus knows addresses and bytes, never
registers or joints.
"""

from bioscara.bus.bus import Bus as Bus
from bioscara.bus.bus import Transaction as Transaction
