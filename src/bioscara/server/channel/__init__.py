"""The channel between the process that moves the arm and the process that answers its clients.

Begin with ``channel_messages``, the messages of both. ``api_process`` is the process of the
clients; in it ``owner_proxy`` stands for the owner: it answers requests that need no control loop,
lets workers compute (``work``), and passes the others on within their ``budget``. ``owner_end`` is
the end in the process of the control loop. ``motion_planning`` lets a worker plan the motions that
clients command.
"""
