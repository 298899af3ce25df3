"""The gateway for the web: a client of an arm's owner that browsers can reach.

Begin with ``app`` and ``routes``, and ``relay``, which joins one WebSocket to the owner's socket.
``guard`` checks each request first: its address with ``addresses``, its credential with ``tokens``
and ``browser_sessions``, its rate with ``rate_limit``; ``scopes`` is what a credential may do.
``owner_stream`` talks to the owner. ``gateway`` listens, with a certificate of ``certificates`` if
none is given. Needs the extra ``web``.
"""
