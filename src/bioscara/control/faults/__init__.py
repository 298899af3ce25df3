"""Faults of the arm as a whole: detection, stop, latch, acknowledgement and recovery.

Begin with ``supervisor``. ``kinds`` lists the faults and the stop of each, ``following_error``
detects one of them, ``stop`` brings the arm to rest, ``flight_recorder`` and ``log`` keep the
evidence, which a writer from outside puts into files.
"""
