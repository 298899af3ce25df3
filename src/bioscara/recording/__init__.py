"""Recordings of a served arm, as MCAP files with messages of ROS 2.

``writing`` is the recorder, a client of the owner, and ``reading`` what reads, completes, exports
and replays its files, whose format is in ``bioscara.rosbag``. Begin with ``writing.recorder`` and
``reading.scan``. ``content`` has the names that both know.
"""
