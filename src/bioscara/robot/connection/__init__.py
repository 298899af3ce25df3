"""The connection to one arm: its devices, the control stack above them, and the calls that use it.

Begin with ``arm_session``: it connects, enables, disables and shuts down one arm. It gets the bus
and the gripper that ``devices`` selects, and assembles the ``stack`` above them: hardware,
controllers, supervisor and control loop. ``state_reader`` reads the joint states and
``fault_recovery`` recovers from faults. ``call_arbiter`` admits one call at a time, and ``pacing``
holds simulated time back to real time. Nothing here plans a motion or makes the arm move.
"""
