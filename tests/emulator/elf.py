"""The parts of an ELF file needed to run it: loaded segments with their addresses, and symbols."""

from __future__ import annotations

import struct
from pathlib import Path


class Image:
    """An executable for the Cortex-M4."""

    def __init__(self, path: Path) -> None:
        data = path.read_bytes()
        if data[:7] != b"\x7fELF\x01\x01\x01":
            raise ValueError(f"{path} is no 32-bit little-endian ELF file")
        programs, sections = struct.unpack_from("<II", data, 28)
        size, count, section_size, section_count = struct.unpack_from("<HHHH", data, 42)
        self.path = path
        self.segments: list[tuple[int, bytes]] = []
        """Load address and content of the segments programmed into the flash."""
        for index in range(count):
            kind, offset, _, physical, length = struct.unpack_from(
                "<IIIII", data, programs + index * size
            )
            if kind == 1 and length:
                self.segments.append((physical, data[offset : offset + length]))
        self.symbols: dict[str, int] = {}
        headers = [
            struct.unpack_from("<10I", data, sections + index * section_size)
            for index in range(section_count)
        ]
        for header in headers:
            if header[1] != 2:
                continue
            names = headers[header[6]][4]
            for at in range(header[4], header[4] + header[5], header[9]):
                name, value = struct.unpack_from("<II", data, at)
                end = data.index(b"\0", names + name)
                self.symbols[data[names + name : end].decode()] = value
