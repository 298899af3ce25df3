"""The state of an arm for its clients; nothing here changes it.

Begin with ``sampling``, which takes samples in the control loop. ``history`` keeps those of the
last ten minutes. ``joint_reports`` reads firmware, reset causes and error counters from the joints.
``queries`` answers questions about workspace, faults, controllers and goals.
"""
