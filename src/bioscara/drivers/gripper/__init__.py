"""The parallel gripper: a width goes in, a PWM signal comes out."""
