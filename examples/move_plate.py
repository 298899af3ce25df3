"""Move a microplate from one place to another."""

import math
import os
import sys

from bioscara import Pose, Prism, Robot, Scene, load_parameters

FROM = Pose(0.10, 0.35, 0.011, math.pi / 2)
TO = Pose(-0.2, 0.4, 0.011, math.pi / 2)
"""Start and goal of the plate: the point between the finger tips."""
LIFT = 0.08
OPEN, GRIP = 0.10, 0.083
EMPTY = Scene(table_height=0.0)
PLATE = Prism(x=0.119, y=0.0, half_x=0.064, half_y=0.043, low=-0.1551, high=-0.1407)
"""The plate in the gripper, in the frame of the wrist; it may touch the table that it stands on."""
LADEN = EMPTY.carrying(PLATE, touches=["table"])

mine = load_parameters(overlay=os.environ.get("BIOSCARA_PARAMETERS") or None)
robot = Robot.connect(sys.argv[1], mine) if sys.argv[1:] else Robot.simulated()
with robot:
    robot.home()
    robot.move_joints([0.0, 0.2, 0.0, 0.0])  # Out of the folded position in which homing ends.
    robot.scene = EMPTY
    for place, before, after, scene in ((FROM, OPEN, GRIP, LADEN), (TO, GRIP, OPEN, EMPTY)):
        above = place._replace(z=place.z + LIFT)
        robot.gripper.move(before)
        robot.move_to(above)
        robot.move_linear(place, velocity_scaling=0.3)
        robot.gripper.move(after)
        robot.scene = scene
        robot.move_linear(above)
        width = 1e3 * robot.gripper.width
        print(f"left ({place.x:.2f}, {place.y:.2f}) with {width:.0f} mm between the jaws")
