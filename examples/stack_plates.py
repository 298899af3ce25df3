"""Move a stack of microplates to another one; in a terminal, Enter pauses and resumes."""

import math
import sys
import threading

from bioscara import Box, Frame, Load, Pose, Prism, Robot, Scene

PLATES, HEIGHT = 3, 0.0144
NEST = 0.03
"""Height of the two nests on which the stacks stand [m]."""
GRIP = 0.0105
"""Height above a plate's bottom at which the point between the finger tips holds it [m]."""
ABOVE = 0.11
"""Height above the bench at which plates are carried [m]."""
PLATE = Load(
    "plate",
    Prism.between((-0.0639, -0.0427, -GRIP), (0.0639, 0.0427, HEIGHT - GRIP)),
    mass=0.04,
    touches=("left", "right"),
)
BENCH = Frame("bench", Pose(0.0, 0.4, 0.0, math.pi / 2))
"""x of the bench is away from the arm, and y to its left; if taught, robot.frame("bench")."""
SIDES = {"left": 0.12, "right": -0.12}
"""Place of each stack along y of the bench [m]."""


def place(side: str, plates: int) -> Pose:
    """Return the pose of the tool for the plate on top of this number of plates."""
    return BENCH.pose(0.0, SIDES[side], NEST + plates * HEIGHT + GRIP)


def stack(side: str, plates: int) -> Box:
    """Return the zone of a nest with this number of plates."""
    x, y, _, _ = BENCH.pose(0.0, SIDES[side])
    top = NEST + plates * HEIGHT
    return Box(side, (x - 0.0427, y - 0.0639, 0.0), (x + 0.0427, y + 0.0639, top))


def pause_on_enter(robot: Robot) -> None:
    """Pause and resume in turn, whenever a line is entered."""
    for number, _ in enumerate(sys.stdin):
        if number % 2:
            robot.resume()
        else:
            robot.pause()
        print("goes on" if number % 2 else "paused; Enter continues")


robot = Robot.connect(sys.argv[1]) if sys.argv[1:] else Robot.simulated()
with robot:
    if sys.stdin.isatty():
        threading.Thread(target=pause_on_enter, args=(robot,), daemon=True).start()
    robot.home()
    robot.unfold()
    robot.gripper.move(PLATE.width + 0.012)
    for moved in range(PLATES):
        left = PLATES - moved - 1
        # A plate in transit is in neither stack.
        robot.scene = Scene((stack("left", left), stack("right", moved)), table_height=0.0)
        start, goal = place("left", left), place("right", moved)
        robot.move_to(start._replace(z=ABOVE))
        robot.move_linear(start)
        robot.gripper.grasp(PLATE)
        robot.move_linear(start._replace(z=ABOVE))
        robot.move_to(goal._replace(z=ABOVE))
        robot.move_linear(goal, velocity_scaling=0.5)
        robot.gripper.release(0.015)
        robot.move_linear(goal._replace(z=ABOVE))
        print(f"plate {moved + 1} of {PLATES} at {goal}")
