"""Fills the identity of a linked image: its length and its CRC-32, in the ELF and as a BIN.

``seal.py j1.elf j1.bin`` makes the BIN out of the ELF's segments and patches both. The identity
lies at offset 0x200 of the BIN, little endian: ``char magic[8] = "BIOSCARA"``, ``u8 format = 1``,
``u8 joint, major, minor, patch``, ``u8 reserved[3]``, ``u32 length`` (bytes of the BIN) and ``u32
crc32`` (as ``zlib.crc32`` of the BIN with this field taken as 0xFFFFFFFF). The firmware checks it
at each start, ``bioscara flash`` before it writes. Standard library only.
"""

from __future__ import annotations

import struct
import sys
import zlib
from pathlib import Path

FLASH = 0x0800_0000
IDENTITY = 0x200
MAGIC = b"BIOSCARA"
FORMAT = 1
LENGTH_AT = IDENTITY + 16
CRC_AT = IDENTITY + 20
BLANK = b"\xff\xff\xff\xff"

_LOAD = 1


def seal(elf: bytes) -> tuple[bytes, bytes]:
    """Return the sealed ELF and the BIN of the linked ``elf``.

    Raises:
        ValueError: The file is not a 32-bit ELF, has nothing at the start of the flash, or has no
            identity.
    """
    segments = _flash_segments(elf)
    image = _flatten(elf, segments)
    identity = image[IDENTITY : IDENTITY + 9]
    if identity != MAGIC + bytes([FORMAT]) or len(image) < CRC_AT + 4:
        raise ValueError(
            f"no identity at offset {IDENTITY:#x}: {identity!r}; is image.cpp linked into it?"
        )
    struct.pack_into("<I", image, LENGTH_AT, len(image))
    image[CRC_AT : CRC_AT + 4] = BLANK
    struct.pack_into("<I", image, CRC_AT, zlib.crc32(image))
    sealed = bytearray(elf)
    for offset, address, size in segments:
        sealed[offset : offset + size] = image[address : address + size]
    return bytes(sealed), bytes(image)


def _flash_segments(elf: bytes) -> list[tuple[int, int, int]]:
    """Segments loaded into the flash: (offset in the file, offset in the flash, bytes)."""
    if elf[:6] != b"\x7fELF\x01\x01":
        raise ValueError("not a 32-bit little-endian ELF")
    table, size, count = (*struct.unpack_from("<I", elf, 28), *struct.unpack_from("<HH", elf, 42))
    segments = []
    for index in range(count):
        kind, offset, _, load_address, length = struct.unpack_from("<5I", elf, table + index * size)
        if kind == _LOAD and length > 0:
            if load_address < FLASH:
                raise ValueError(f"a segment is loaded at {load_address:#010x}, below the flash")
            segments.append((offset, load_address - FLASH, length))
    if min((address for _, address, _ in segments), default=-1) != 0:
        raise ValueError(f"nothing is loaded at {FLASH:#010x}, where the vector table belongs")
    return segments


def _flatten(elf: bytes, segments: list[tuple[int, int, int]]) -> bytearray:
    """The flash's content; gaps are 0xFF as in erased flash, and whole words at the end."""
    end = max(address + size for _, address, size in segments)
    image = bytearray(b"\xff" * (end + -end % 4))
    for offset, address, size in segments:
        image[address : address + size] = elf[offset : offset + size]
    return image


def main(arguments: list[str]) -> int:
    """Seal the ELF named first in place and write the BIN named second."""
    elf_path, bin_path = map(Path, arguments)
    try:
        sealed, image = seal(elf_path.read_bytes())
    except ValueError as error:
        sys.stderr.write(f"{elf_path}: {error}\n")
        return 1
    elf_path.write_bytes(sealed)
    bin_path.write_bytes(image)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
