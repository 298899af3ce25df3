"""The controllers of clients at an owner.

Begin with ``requests``, which carries out the requests of clients. ``loadable_controllers`` checks
name, type and parameters of a new controller, ``controller_goals`` numbers the goals and keeps
their ends, ``sampling`` takes samples.
"""
