"""The firmware image of a joint: its joint number, version and integrity.

The linker places an identity at a fixed offset, behind the vector table. Little endian:

    offset  bytes
    0x200   8   magic, the letters BIOSCARA
    0x208   1   format of this identity, 1
    0x209   1   number of the joint, 1 .. 4
    0x20A   3   version: major, minor, patch
    0x20D   3   reserved
    0x210   4   length of the image [bytes]
    0x214   4   CRC-32 (as in zlib) of the image, with this field taken as 0xFFFFFFFF
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from pathlib import Path

from bioscara.errors import ImageError
from bioscara.version import __version__

JOINTS = (1, 2, 3, 4)
"""Numbers of the joints for which images exist."""
FLASH_SIZE = 256 * 1024
"""Flash size of the STM32F401RC [bytes], from its data sheet."""

PACKAGED = Path(__file__).parent / "images"
"""Folder of the images that the wheel of a release has."""

_OFFSET = 0x200
_IDENTITY = struct.Struct("<8sBBBBB3xII")
_MAGIC = b"BIOSCARA"
_FORMAT = 1
_CRC_AT = _OFFSET + _IDENTITY.size - 4
_ELF = b"\x7fELF"


@dataclass(frozen=True, slots=True)
class Image:
    """A firmware image that was checked to be complete.

    Attributes:
        name: Origin of the image, for messages.
        joint: Number of the joint that it is for.
        version: Major, minor and patch.
        content: The bytes to write to the start of the flash.
        crc: CRC-32 of the content, as a joint that runs it reports.
    """

    name: str
    joint: int
    version: tuple[int, int, int]
    content: bytes
    crc: int

    @classmethod
    def from_bytes(cls, name: str, content: bytes) -> Image:
        """Return the image in ``content``.

        Args:
            name: Origin of the image, for messages.
            content: All bytes of the image.

        Raises:
            ImageError: It is no image of this project, or it is truncated or damaged.
        """
        if not content:
            raise ImageError(f"{name} is empty; build it or download it again")
        if content.startswith(_ELF):
            raise ImageError(
                f"{name} is an ELF file, for debuggers; flash "
                f"{Path(name).with_suffix('.bin').name}, which was built with it"
            )
        if len(content) > FLASH_SIZE:
            raise ImageError(
                f"{name} has more than the {FLASH_SIZE} bytes of the controller's flash; take a "
                ".bin of 'make firmware'"
            )
        if content[_OFFSET : _OFFSET + len(_MAGIC)] != _MAGIC:
            raise ImageError(
                f"{name} is not joint firmware of bioscara: the letters BIOSCARA are missing at "
                f"offset {_OFFSET:#x}; 'make firmware' builds j1.bin .. j4.bin"
            )
        if len(content) < _OFFSET + _IDENTITY.size:
            raise ImageError(f"{name} ends inside its identity, after {len(content)} bytes")
        _, form, joint, *version, length, crc = _IDENTITY.unpack_from(content, _OFFSET)
        if form != _FORMAT:
            raise ImageError(
                f"{name} has an identity of format {form}, known is {_FORMAT}; flash it with the "
                "bioscara that it was released with"
            )
        if len(content) != length:
            what = "truncated" if len(content) < length else "damaged"
            raise ImageError(
                f"{name} is {what}: it has {len(content)} bytes and says {length}; build it or "
                "download it again"
            )
        found = zlib.crc32(content[:_CRC_AT] + b"\xff" * 4 + content[_CRC_AT + 4 :])
        if found != crc:
            raise ImageError(
                f"{name} is damaged: its CRC is {found:#010x} and should be {crc:#010x}; build it "
                "or download it again"
            )
        return cls(name, joint, (version[0], version[1], version[2]), content, crc)

    def require(self, joint: int) -> None:
        """Raise unless this is an image for ``joint`` and compatible with this bioscara.

        Raises:
            ImageError: It is for another joint, or of another version than this bioscara.
        """
        if self.joint != joint:
            raise ImageError(
                f"{self.name} is firmware for j{self.joint}, not for j{joint}: two boards with one "
                f"number answer at one address; take the image of j{joint}"
            )
        if self.version[:2] != _host_version():
            raise ImageError(
                f"{self.name} is version {dotted(self.version)}, this is bioscara "
                f"{__version__}; flash it with bioscara {dotted(self.version[:2])}, or "
                f"take an image of version {dotted(_host_version())}"
            )


def read_image(path: Path | str) -> Image:
    """Return the image in a file.

    Raises:
        ImageError: It cannot be read, or as :meth:`Image.from_bytes`.
    """
    try:
        with Path(path).open("rb") as file:
            content = file.read(FLASH_SIZE + 1)
    except OSError as error:
        raise ImageError(f"{path} cannot be read: {error.strerror or error}") from error
    return Image.from_bytes(str(path), content)


def released_name(joint: int) -> str:
    """Return the name under which a release has the image of a joint."""
    return f"bioscara-{__version__}-j{joint}.bin"


def prebuilt(joint: int) -> Path:
    """Return the available image of this version: built in this checkout, released, or downloaded.

    Raises:
        ImageError: There is none; the message states where to get one.
    """
    name = f"j{joint}.bin"
    built, released = Path(__file__).parents[3] / "firmware" / "build", Path(released_name(joint))
    for path in (built / name, PACKAGED / name, released):
        if path.is_file():
            return path
    raise ImageError(
        f"there is no image for j{joint} here: build it with 'make firmware' in a checkout, or "
        f"download {released} of release {__version__} into this folder, or name a file"
    )


def known_images() -> dict[int, str]:
    """Return the file names of the images that :func:`prebuilt` finds, by their CRC-32."""
    names: dict[int, str] = {}
    for joint in JOINTS:
        try:
            path = prebuilt(joint)
            names[read_image(path).crc] = path.name
        except ImageError:
            continue
    return names


def dotted(version: tuple[int, ...]) -> str:
    """Return a version in dotted notation."""
    return ".".join(map(str, version))


def _host_version() -> tuple[int, ...]:
    return tuple(int(part) for part in __version__.split(".")[:2])
