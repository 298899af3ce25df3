"""The node of ROS 2 that clients of ros2_control, MoveIt and RViz take for a controller manager.

``node`` combines everything; it is a client of the arm's owner. ``description`` and ``frames`` read
the URDF, ``parameters`` those of controllers, ``requests`` turns messages of ROS into values and
``messages`` turns values into messages. ``owner`` is the connection with its lease,
``owner_process`` an owner of the node's own. ``manager_services`` are the services of
controller_manager_msgs; ``loaded`` has the controllers that were loaded, each a node with its
topics and actions: ``trajectory``, ``gripper``, ``homing``, ``forward`` and ``broadcaster``.
``observation`` publishes activity, diagnostics and statistics, ``arm_services`` and ``arm_actions``
offer what ros2_control does not have.

Modules that import rclpy are imported only by ``bioscara ros``: it is no dependency.
"""
