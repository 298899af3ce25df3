"""MCAP files with messages of ROS 2, as ``ros2 bag`` writes and plays them.

Begin with ``recording_file``, a file while it is written. ``topics`` lists its topics with the
types of their messages; ``joint_states`` encodes the state of all joints in each cycle and
``texts`` the rest, both with ``cdr``. The package ``recording`` reads such files.
"""
