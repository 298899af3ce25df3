"""Operations for clients that load and switch controllers themselves, as in ros2_control.

Begin with ``run_controllers``: the operation that runs while controllers of clients are active.
``planned_goal`` plans their trajectory goals from where the arm rests; ``goal_course`` has the
motion that a goal asks for. ``commands`` are the goals that depend on the whole arm, and
``change_hardware_state`` sets the lifecycle state of hardware components.
"""
