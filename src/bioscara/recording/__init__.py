"""Recordings of a served arm, as MCAP files with messages of ROS 2.

Begin with ``recorder``, a client of the owner that writes a ``recording_file`` after another into a
``folder``. ``topics`` lists the topics of a file; ``sample_messages`` encodes the state of each
cycle and ``messages`` the rarer ones, both with ``cdr``. ``scan`` reads a file, also one that its
writer never finished; on it build ``recovery``, ``contents``, ``export``, ``joint_motion`` and
``replay``. Modules other than ``installed`` need the packages of the extra ``record``.
"""
