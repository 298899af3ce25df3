"""The arm as a 3D page in the browser; needs viser (the extra ``view``).

``page`` shows the arm at given positions, with its nearest pair of bodies, its ``readouts`` and the
path of its tool. The positions come from ``sliders``, from a ``player`` that replays a
``played_motion``, or from ``live``, an arm that moves now. ``kinematic_tree`` computes the poses of
the links of a URDF, ``zones`` shows the zones and the table. The viewer sends no commands: no bus
is opened.

``access_control`` refuses requests of other sites.
"""
