"""The controllers of clients at an owner.

Begin with ``requests``, which carries out what clients ask. ``parameters`` is what an arm accepts
of a new controller, ``goals`` numbers the goals and keeps their ends, ``sampling`` takes samples.
"""
