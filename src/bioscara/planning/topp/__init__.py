"""Time-optimal path parameterisation: timing of a path from limits.

Begin with ``topp``. ``constraints`` converts limits of joints and tool to limits of the speed along
the path, ``phase_plane`` finds the fastest speed below them, ``diagnostics`` explains a refusal.
"""
