"""The gateway for the web: a client of an arm's owner that browsers can reach.

Begin with ``app``, which joins the ``routes`` with the settings of ``settings``. ``access`` checks
each request before a route sees it: its sender, origin and rate. ``owner`` are the
connections to the owner of the arm, also for a WebSocket. ``gateway`` listens, with TLS;
``connections`` has the places of its connections, ``protocols`` their limits of time and rate.
Needs the extra ``web``.
"""
