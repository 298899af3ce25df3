"""Operations of the arm, each an object that the control loop steps from cycle to cycle.

Begin with ``operation``: an ``Operation`` is begun, stepped, paused, resumed and cancelled, and has
a status, a progress and a result or an error. ``execution`` moves the arm within an operation and
brings it to rest however that ends. ``arbiter`` admits one operation for each device, and
``cycle_recorder`` records the cycles of one.

The operations are in three places: ``motions`` has all that move the arm or the jaws,
``controllers`` runs and switches the controllers of clients, and the other modules of this folder
switch power, clear faults, change the workspace and read counters. ``Runner`` in ``robot.runner``
begins and steps them; they act on the parts of ``Arm`` in ``robot.arm``.
"""
