"""One joint as an object, in joint units.

Begin with ``joint``: it is composed of ``feedback`` (measured state), ``settings``, ``limits`` (of
setpoints), ``readiness``, ``homing``, ``monitor`` (waits for the end of a motion) and ``cyclic``.
``group`` exchanges setpoints and samples of several joints in the control cycle; ``transmission``
converts between joint and motor units; ``plausibility`` checks version 1 answers.
"""
