"""The connection to one arm: its devices and the control stack above them.

Begin with ``arm_session``: it connects, enables, disables and shuts down one arm. It gets the bus
and the gripper that ``devices`` selects, and assembles the ``stack`` above them: hardware,
controllers, supervisor and control loop; ``evidence_folder`` writes the flight records of faults.
``pacing`` holds simulated time back to real time. Nothing
here plans a motion or makes the arm move.
"""
