"""Permission to use a gateway: by token, origin, scope and rate.

Begin with ``guard``, which checks each request before a route sees it: its address with
``addresses``, its credential with ``tokens`` and ``browser_sessions``, its rate with
``rate_limit``. ``certificates`` makes the certificate of a gateway that has none. A request comes
in; its scope or a refusal goes out.
"""
