"""Home the simulated arm and move it; with a bus as argument, for example linux:1, a real one."""

import sys

from bioscara import Robot

robot = Robot.connect(sys.argv[1]) if sys.argv[1:] else Robot.simulated()
with robot:
    robot.home()
    robot.unfold()
    robot.move_joints([0.0, 0.20, 0.5, -0.5], velocity_scaling=0.5)
    for name, position in zip(robot.state.names, robot.state.positions, strict=True):
        print(f"{name} {position:+.4f}")
