"""The messages between the owner of an arm and its clients.

Begin with ``messages``: every request, answer, state and event as a struct. ``framing`` turns them
into bytes and back; ``failures`` carries errors across; ``values`` converts the values that a
robot uses; ``runtime`` finds the sockets of running owners. Nothing here opens a connection or
knows an arm.
"""
