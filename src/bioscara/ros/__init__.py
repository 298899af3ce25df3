"""The node of ROS 2 that clients of ros2_control, MoveIt and RViz take for a controller manager.

Begin with ``node``, which combines everything; it is a client of the arm's owner. ``controllers``
are the services of the manager and the controllers that clients load, ``arm`` the description, the
frames and what ros2_control does not have. ``observation`` publishes activity, diagnostics and
statistics.

``requests`` turns messages of ROS into values and ``messages`` turns values into messages, with the
times of ``arm_time``. ``owner`` is the connection with its lease, ``owner_process`` an owner of the
node's own. ``bridge`` has the functions of the node that all parts share.

Modules that import rclpy are imported only by ``bioscara ros``: it is no dependency.
"""
