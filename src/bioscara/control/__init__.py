"""Controllers and who runs them: measured states come in, bounded commands go out, each cycle.

``controller`` is what every controller is, with ``parameters`` and ``goals``; then a file for each:
``forward_command_controller``, ``gripper_action_controller`` (``gripper_messages``),
``hold_controller``, ``homing_controller``, ``jog_controller``, ``joint_state_broadcaster``, and
``joint_trajectory``, a folder. ``registry`` has them by the names of ROS.

``manager`` owns them, with ``roster`` (their lives), ``claims`` (who may command what),
``switching`` (what a request comes to), ``handover`` (carrying it out), ``schedule`` (who is due)
and ``execution`` (running what may fail). ``listing``, ``statistics``, ``diagnostics`` and
``introspection`` tell of it, as ROS does.

``limiting`` is the last stage before the bus: ``guard`` bounds each joint by itself (``braking``),
``tool_speed`` and ``clearance`` all of them together, ``smoothing`` averages what nobody planned.

``loop`` runs the manager on time, with ``realtime`` and ``watchdog``. ``supervisor`` looks at each
cycle and stops the arm: ``resting`` is how, ``following`` compares it with what it was told,
``faults`` is what can go wrong, ``fault_log`` what did, ``flight_record`` the evidence.
"""
