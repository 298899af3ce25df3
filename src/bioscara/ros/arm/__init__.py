"""The arm as clients of ROS see it: its description, its frames, and planned motions.

Begin with ``description``, which translates names in the URDF into those of the owner;
``control_tags`` reads its hardware, ``described_values`` compares the values with the owner's.
``robot_frames`` publishes it with the poses of its links, as robot_state_publisher does.
``services`` and ``actions`` offer what ros2_control does not have: plans, named poses, STOP, faults
and planned motions of the tool. These two need the package ``bioscara_interfaces``.
"""
