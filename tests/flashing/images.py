"""Firmware images for tests, made from the format's description and not by the code under test."""

from __future__ import annotations

import zlib


def image(joint: int = 1, version: tuple[int, int, int] = (0, 1, 0), size: int = 5000) -> bytes:
    """Return a whole image; its content differs from joint to joint."""
    content = bytearray((index * 7 + joint) & 0xFF for index in range(size))
    content[0x200:0x208] = b"BIOSCARA"
    content[0x208:0x210] = bytes((1, joint, *version, 0, 0, 0))
    content[0x210:0x214] = size.to_bytes(4, "little")
    return sealed(content)


def sealed(content: bytes | bytearray) -> bytes:
    """Return the image with the CRC that belongs to it."""
    sealed = bytearray(content)
    sealed[0x214:0x218] = b"\xff\xff\xff\xff"
    sealed[0x214:0x218] = zlib.crc32(sealed).to_bytes(4, "little")
    return bytes(sealed)


def crc_of(content: bytes) -> int:
    """Return the CRC-32 of an image that is whole."""
    return int.from_bytes(content[0x214:0x218], "little")
