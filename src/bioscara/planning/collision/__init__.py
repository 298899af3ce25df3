"""Collision checking of an arm against zones, the table, its load and itself.

Begin with ``scene``, which computes distances and refusals from zones and a margin. ``swept``
checks a trajectory, ``stopping`` and ``stop_guard`` check that a moving arm can still stop clear of
everything. Bodies are in ``arm_bodies``, their geometry in ``shapes``, the choice of pairs in
``arm_pairs``, ``scene_pairs`` and ``broad_phase``, distances to keep in ``margins``.
"""
