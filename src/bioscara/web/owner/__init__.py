"""The connections of a gateway to the owner of its arm, and to those of the other arms here.

Begin with ``stream``, one connection to an owner's socket. ``queries`` asks questions over one for
all routes, and ``facts`` keeps frequent answers for a second. ``relay`` joins a WebSocket to a
connection of its own, with an ``outbox`` for the messages that a slow client has not read yet.
``served_arms`` lists all arms that are served on this computer, and stops them.
"""
