"""The work of clients: the tasks that they begin, and the goals that these become.

Begin with ``owner_tasks``, which makes the operation of a task. ``goals`` numbers the
operations and keeps their results. ``jog_stream`` takes the velocities of a jog while it runs, and
``uploads`` collects the parts of a trajectory until it is complete.
"""
