"""A whole arm as one object: home it, move it, stop it, deal with its faults.

``robot`` has the one object, ``stack`` wires everything below it, ``running`` keeps the loop going
while something moves, ``records`` what the joints said, ``pacing`` simulated time for people who
watch.

Law: whatever ends a motion, every joint that can be reached is at rest before control returns to
the caller's exception.
"""

from bioscara.robot.robot import FAULTS as FAULTS
from bioscara.robot.robot import Robot as Robot
from bioscara.robot.robot import kinematics_of as kinematics_of
