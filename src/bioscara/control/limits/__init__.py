"""The last stage before the bus: every command of every source is bounded here.

Begin with ``limiter``, which runs ``joint_limiter`` for each joint, then ``tool_speed`` and
``collision_guard``. ``averaging`` keeps raw commands from making the belts swing.
"""
