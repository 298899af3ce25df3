"""The owner of an arm: one process that runs its control loop for clients.

Begin with ``serve``, which opens the arm, runs its loop and listens. ``owner`` carries out the
requests of ``clients``, of which one has the lease and commands: their ``tasks``, their
``controllers``, and questions about the ``state``. ``kept_files``, ``bench_file`` and
``overlay_file`` keep the values that clients set, and ``simulation`` sets faults and speed of a
simulated arm. ``gateways`` runs other programs for the owner, and ``log`` is the log of all.
Nothing here moves the arm except by operations of ``bioscara.robot``.
"""
