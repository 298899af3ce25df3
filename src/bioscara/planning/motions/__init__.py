"""Motions a user asks for: poses or joints go in, trajectories come out.

``point_to_point`` moves the joints, ``cartesian`` the tool on lines and arcs, ``sequence`` the tool
through ``waypoints``; ``jog`` streams velocities. ``tool_speed`` bounds the speed of the tool.
"""
