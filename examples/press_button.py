"""Press a button: approach it, push at a tenth of the speed, retract."""

import sys

from bioscara import Pose, Robot

BUTTON = Pose(0.55, 0.10, 0.12)
"""Pose at which the finger tips touch the button, in the base."""
APPROACH, STROKE = 0.05, 0.004

robot = Robot.connect(sys.argv[1]) if sys.argv[1:] else Robot.simulated()
with robot:
    robot.home()
    robot.gripper.move(0.04)
    robot.move_to(BUTTON._replace(z=BUTTON.z + APPROACH))
    robot.move_linear(BUTTON._replace(z=BUTTON.z - STROKE), velocity_scaling=0.1)
    print(f"pushed to z = {robot.pose.z:.4f} m")
    robot.move_linear(BUTTON._replace(z=BUTTON.z + APPROACH))
    print(f"retracted to z = {robot.pose.z:.3f} m")
