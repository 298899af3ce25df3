"""The arm's description as a 3D page in the browser; needs viser (``pip install bioscara[view]``).

``kinematic_tree`` computes the poses of the links of a URDF, ``page`` shows them with a slider for
each joint, ``zones`` shows the zones and the table. The viewer sends no commands: no bus is opened.

``access_control`` refuses requests of other sites.
"""
