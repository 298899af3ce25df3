"""The state of an arm for its clients; nothing here changes it.

Begin with ``sampling``, which takes samples in the control loop. ``history`` keeps those of the
last ten minutes, ``joint_reports`` asks the joints for what is not in a sample, and ``queries``
answers questions about workspace, faults, controllers and goals.
"""
