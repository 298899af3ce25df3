"""Paths of the tool: where it goes, not when.

Lines, arcs and blended corners go into ``path``; ``inverse_kinematics`` gives the joints along it.
"""
