"""The arm's description as a 3D page in the browser; needs viser (``pip install bioscara[view]``).

``tree`` places the links of a URDF, ``page`` shows them with a slider for each joint, ``zones``
what stands around them. It commands nothing: no bus is opened.

``guard`` refuses requests of other sites.
"""
