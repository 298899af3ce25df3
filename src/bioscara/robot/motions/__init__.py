"""Motions of one arm: from a plan, a trajectory or a stream of velocities to an arm at rest.

Begin with ``arm_motions``, which homes the joints, follows plans and trajectories and jogs, and
``gripper``, which moves the jaws. Both run the control loop through ``execution``, which brings
the arm to rest however a motion ends. ``cycle_recorder`` builds the records that observers receive,
and ``homing_order`` selects the joints that are homed together.
"""
