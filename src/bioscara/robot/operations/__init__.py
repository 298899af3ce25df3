"""Operations of the arm, each an object that the control loop steps from cycle to cycle.

Begin with ``operation``: an ``Operation`` is begun, stepped, paused, resumed and cancelled, and has
a status, a progress and a result or an error. ``execution`` moves the arm within an operation and
brings it to rest however that ends. ``arbiter`` admits one operation for each device, and
``cycle_recorder`` records the cycles of one.

The other modules and folders are the operations: ``motions``, those for ``controllers`` of clients,
and here those that move nothing. ``Arm`` in ``robot.arm`` begins and steps them.
"""
