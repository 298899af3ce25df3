"""The recorder: a client of an owner that writes one file after another.

Begin with ``recorder``. It has an ``owner_recorder`` for each run of the owner, which writes what
an ``arm_feed`` receives into files of a ``folder``. ``sample_messages`` encodes the state of each
cycle and ``rare_messages`` the rest; ``wall_clock`` has the times.
"""
