"""A whole arm: wires bus, joints and clock, homes, follows a trajectory, stops.

``robot`` has the one object, ``streaming`` the motion loop, ``homing`` and ``stopping`` the two
other ways in which the arm is busy, ``timeline`` where each joint should be, ``records`` what
they said, ``pacing`` simulated time for people who watch.

Law: whatever ends a motion, every joint is told to stop and to let go before control returns to
the caller's exception.
"""

from bioscara.robot.robot import Robot as Robot
