"""One joint as an object, in joint units.

Begin with ``joint``. ``cyclic`` and ``group`` exchange setpoints and samples in the control cycle;
``transmission`` converts between joint and motor units; ``original`` holds the rules for joints
with their original firmware.
"""
