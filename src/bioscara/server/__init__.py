"""The owner of an arm: one process that runs its control loop, and another one for its clients.

Begin with ``serve``, which opens the arm, runs its loop and starts the other process. ``clients``
are answered there, and what concerns the loop comes through the ``channel`` to ``owner``, which
carries it out. One client has the lease and commands: its ``tasks``, its ``controllers``; all may
ask about the ``state``. ``kept_files``, ``bench_file`` and
``overlay_file`` keep the values that clients set, and ``simulation`` sets faults and speed of a
simulated arm. ``gateways`` runs other programs for the owner, and ``log`` is the log of all.
Nothing here moves the arm except by operations of ``bioscara.robot``.
"""
