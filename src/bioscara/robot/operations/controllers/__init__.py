"""Operations for clients that load and switch controllers themselves, as in ros2_control.

Begin with ``run_controllers``: the operation that runs while controllers of clients are active.
``commands`` are the goals for them that depend on the whole arm, and ``change_hardware_state`` sets
the lifecycle state of hardware components.
"""
