"""Operations that move the joints or the jaws of the gripper.

Begin with ``follow_trajectory``, which carries out every planned motion. ``home`` homes the joints
that ``homing_order`` chooses, and ``jog`` follows streamed velocities. ``move_gripper`` moves the
jaws; ``grasp`` also attaches a load, or releases it. A request comes in, goals of the arm's own
controllers go out.
"""
