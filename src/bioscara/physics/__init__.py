"""A world around the simulated joints, in which things are gripped, carried and dropped.

The firmware simulation computes the joints' mechanics as before. MuJoCo computes the rest: the
jaws, labware, nests, walls and the table. In go a world (:mod:`bioscara.planning.world`) and a
simulated arm with its servo; out come contact torques on the joints, and the poses of the bodies.
"""
