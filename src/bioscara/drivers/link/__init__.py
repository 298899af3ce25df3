"""Frames to and from one joint.

``session`` sends a frame and returns its answer, after the ``handshake`` found the protocol version
of the joint. ``errors`` turns refusals into exceptions, ``joint_reports`` decodes a joint's
reports; ``original`` holds the timing rules for joints with their original firmware.
"""
