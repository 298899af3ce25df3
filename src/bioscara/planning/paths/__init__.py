"""Paths of the tool: geometry without times.

``segments`` has lines and arcs, ``blending`` rounds the corners between them;
``inverse_kinematics`` gives the joints along a path.
"""
