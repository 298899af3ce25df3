"""User-level motions: trajectories from poses or joint positions.

``point_to_point`` moves the joints, ``cartesian`` the tool on lines and arcs, ``sequence`` the tool
through ``waypoints``; ``jog`` streams velocities. ``tool_speed`` bounds the speed of the tool.
"""
