"""Versions of a joint's firmware in words."""

from __future__ import annotations

from bioscara.drivers import Joint


def firmware_of(joint: Joint) -> str:
    """Return the protocol and firmware versions of a joint, in words."""
    if joint.hello is None:
        return "protocol 1"
    major, minor = joint.hello.firmware
    return f"protocol {joint.hello.protocol}, firmware {major}.{minor}"
