"""Processes and threads of this program, without a part of an arm.

Begin with ``worker_pool``, which shares processes among clients: each is a ``worker``, with limits
of time and memory, that forks from the ``nursery``. ``child_process`` starts other commands, which
end with their parent. ``unread_output`` writes output without a wait for its reader. ``forking``
lets a forked child release resources of its parent, and ``scheduling`` wakes threads on time.
"""
