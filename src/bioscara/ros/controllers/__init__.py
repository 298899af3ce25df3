"""Controllers as clients of ROS see them: the services of their manager, and their own topics.

Begin with ``manager_services``, the services of controller_manager_msgs. ``loaded`` has the
controllers that were loaded. Each is a ``controller_node``, a node with its topics and actions:
``trajectory``, ``gripper``, ``homing``, ``forward`` or ``broadcaster``. ``parameters`` turns
those of the node into those of the owner's controller. ``action_goals`` takes the goals of an
action; ``goals`` waits until the owner has ended them.

Messages of ROS come in, and requests to the owner of the arm go out; samples of its controllers
come back and are published.
"""
