"""The owner of an arm: one process that runs its control loop for clients.

Begin with ``serve``, which opens the arm, runs its loop and listens. ``owner`` carries out the
requests of clients, with the ``lease`` of the one who commands, the ``goals`` and the ``events``;
``tasks`` makes the operations of goals and ``queries`` the answers to questions. ``connection`` is
one client on the socket of ``api_server``. ``gateways`` runs other programs for the owner, and
``log`` is the log of all. Nothing here moves the arm except by operations of ``bioscara.robot``.
"""
