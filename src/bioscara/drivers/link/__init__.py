"""Frames to and from one joint.

``session`` sends a frame and returns its answer, after the ``handshake`` found which version the
joint speaks. ``errors`` turns refusals into exceptions.
"""
