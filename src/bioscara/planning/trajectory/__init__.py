"""Timed joint motions: the one type that everything executes, and what can be asked of it.

Begin with ``trajectory``. Limits go into ``validation``, which judges the curve between the points;
``retiming`` slows a trajectory down until it passes.
"""
