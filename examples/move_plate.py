"""Move a microplate from one place to another."""

import math
import sys

from bioscara import Load, Pose, Prism, Robot, Scene

FROM = Pose(0.10, 0.35, 0.011, math.pi / 2)
TO = Pose(-0.2, 0.4, 0.011, math.pi / 2)
"""Start and goal of the plate: the point between the finger tips."""
LIFT = 0.08
OPEN, GRIP = 0.10, 0.083
PLATE = Load(
    "plate", Prism.between((-0.064, -0.043, -0.011), (0.064, 0.043, 0.0034)), touches=("table",)
)
"""The plate as seen from the point between the finger tips; it may touch the table."""

robot = Robot.connect(sys.argv[1]) if sys.argv[1:] else Robot.simulated()
with robot:
    robot.home()
    robot.move_joints([0.0, 0.2, 0.0, 0.0])  # Out of the folded position in which homing ends.
    robot.scene = Scene(table_height=0.0)
    robot.gripper.move(OPEN)
    for place in (FROM, TO):
        above = place.up(LIFT)
        robot.move_to(above)
        robot.move_linear(place, velocity_scaling=0.3)
        if robot.load is None:
            robot.gripper.grasp(PLATE, squeeze=PLATE.width - GRIP)
        else:
            robot.gripper.release()
        robot.move_linear(above)
        width = 1e3 * robot.gripper.width
        print(f"left ({place.x:.2f}, {place.y:.2f}) with {width:.0f} mm between the jaws")
