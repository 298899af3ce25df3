"""Whether an arm keeps clear of zones, the table, its load and itself.

Begin with ``scene``: zones and a margin go in, distances and refusals come out. ``swept`` checks a
trajectory, ``stopping`` and ``stop_guard`` check that a moving arm can still stop clear. Bodies are
in ``arm_bodies``, their geometry in ``shapes``, the choice of pairs in ``arm_pairs``,
``scene_pairs`` and ``broad_phase``.
"""
