"""Time-optimal path parameterisation: a path and limits go in, its timing comes out.

Begin with ``topp``. ``constraints`` turns limits of joints and tool into limits of the path's
speed, ``phase_plane`` finds the fastest speed below them, ``diagnostics`` explains a refusal.
"""
