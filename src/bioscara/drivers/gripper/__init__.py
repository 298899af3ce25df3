"""Driver of the parallel gripper: converts a width to a PWM signal."""
