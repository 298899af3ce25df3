"""The model of the arm in the formats of other programs: URDF, MJCF and glTF."""
