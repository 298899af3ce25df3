"""Timed joint motions: the one type that everything executes, and operations on it.

Begin with ``trajectory``; ``polynomials`` is the curve between its points. ``validation`` checks
that curve against limits; ``retiming`` slows a trajectory down until it passes.
"""
