"""Timed joint motions: the one type that everything executes, and operations on it.

Begin with ``trajectory``. ``validation`` checks the curve between the points against limits;
``retiming`` slows a trajectory down until it passes.
"""
