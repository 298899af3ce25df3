"""Recordings of a served arm, as MCAP files with messages of ROS 2.

Begin with ``recorder``, a client of the owner that writes a ``recording_file`` after another into a
``folder``. ``topics`` lists what is in a file; ``sample_messages`` encodes the state of each cycle
and ``messages`` what comes rarely, both with ``cdr``. ``scan`` reads a file, also one that its
writer never finished; on it build ``recovery``, ``contents``, ``export`` and ``replay``. Modules
other than ``installed`` need the packages of the extra ``record``.
"""
