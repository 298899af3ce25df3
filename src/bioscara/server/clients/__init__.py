"""The clients of an owner: their socket, their messages, and which of them commands the arm.

Begin with ``api_server``, which listens on the socket. ``connection`` is one client on it: requests
come in; answers, samples, records and events go out. ``crowd`` limits their number, and gives each
its share of the time. ``arm_service`` is the interface of an arm
that both need. ``client`` is a client as the owner knows it, ``lease`` lets one of them command,
and ``events`` keeps the latest events, which a client that connects again has missed.
"""
