"""Move the tool along three sides of a rectangle, with rounded corners, without a stop."""

import sys

from bioscara import Motion, Pose, Robot, Waypoint

HEIGHT = 0.2
CORNERS = [(0.5, -0.2), (0.5, 0.2), (0.4, 0.2), (0.4, -0.2)]

robot = Robot.connect(sys.argv[1]) if sys.argv[1:] else Robot.simulated()
with robot:
    robot.home()
    robot.move_to(Pose(*CORNERS[0], HEIGHT))
    plan = robot.plan.move_sequence(
        [Waypoint(Pose(x, y, HEIGHT), Motion.LIN, blend=0.01) for x, y in CORNERS[1:-1]]
        + [Waypoint(Pose(*CORNERS[-1], HEIGHT), Motion.LIN)]
    )
    print(f"around in {plan.trajectory.duration:.2f} s", *plan.notes)
    robot.execute(plan)
    print("tool at ({:.3f}, {:.3f}, {:.3f}) m".format(*robot.pose[:3]))
