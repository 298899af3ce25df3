"""An image is whole and for this joint, or it is refused with the reason."""

from __future__ import annotations

import random
import re
import runpy
import struct
from pathlib import Path

import pytest

import bioscara
from bioscara.errors import ImageError
from bioscara.flashing import JOINTS, Image, image as image_file, prebuilt, read_image
from bioscara.flashing.image import FLASH_SIZE, PACKAGED
from flashing.images import image, sealed

FIRMWARE = Path(__file__).parents[2] / "firmware/joint"


@pytest.mark.parametrize("joint", JOINTS)
@pytest.mark.parametrize("size", [0x218, 5000, 256 * 1024])
def test_a_whole_image_has_its_joint_and_version(joint: int, size: int) -> None:
    content = image(joint, (0, 1, 7), size)
    taken = Image.from_bytes("j.bin", content)
    assert (taken.joint, taken.version, taken.content) == (joint, (0, 1, 7), content)
    taken.require(joint)


def test_every_flipped_bit_is_found() -> None:
    whole = image(size=0x260)
    for bit in range(8 * len(whole)):
        corrupted = bytearray(whole)
        corrupted[bit // 8] ^= 1 << bit % 8
        with pytest.raises(ImageError):
            Image.from_bytes("j1.bin", bytes(corrupted))


def test_every_truncation_is_found() -> None:
    whole = image(size=0x260)
    for length in range(len(whole)):
        with pytest.raises(ImageError, match=r"j1\.bin"):
            Image.from_bytes("j1.bin", whole[:length])


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (random.Random(1).randbytes(20_000), "not joint firmware of bioscara"),
        (
            b"\x7fELF" + image()[4:],
            "an ELF file, for debuggers; flash j1.bin, which was built with it",
        ),
        (image()[:0x210], "ends inside its identity, after 528 bytes"),
        (image()[:4000], "is truncated: it has 4000 bytes and says 5000"),
        (image() + b"\xff", "is damaged: it has 5001 bytes and says 5000"),
        (image()[:-1] + b"\0", "is damaged: its CRC is 0x"),
        (image(size=256 * 1024 + 4), "more than the 262144 bytes of the controller's flash"),
        (sealed(image()[:0x208] + b"\x02" + image()[0x209:]), "format 2, known is 1"),
    ],
)
def test_a_wrong_image_is_refused_with_its_name_and_the_reason(content: bytes, reason: str) -> None:
    with pytest.raises(ImageError, match=f"^j1.bin.*{re.escape(reason)}"):
        Image.from_bytes("j1.bin", content)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (image(2), "is firmware for j2, not for j1"),
        (image(0), "is firmware for j0, not for j1"),
        (image(1, (0, 2, 0)), rf"version 0\.2\.0, this is bioscara {bioscara.__version__}"),
        (image(1, (1, 1, 0)), r"version 1\.1\.0"),
    ],
)
def test_an_image_for_another_joint_or_host_is_refused(content: bytes, reason: str) -> None:
    with pytest.raises(ImageError, match=reason):
        Image.from_bytes("j1.bin", content).require(1)


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    with pytest.raises(ImageError, match=r"nothing\.bin cannot be read: No such file"):
        read_image(tmp_path / "nothing.bin")
    with pytest.raises(ImageError, match="Is a directory"):
        read_image(tmp_path)


def test_an_empty_and_a_huge_file_are_reported(tmp_path: Path) -> None:
    path = tmp_path / "j1.bin"
    path.write_bytes(b"")
    with pytest.raises(ImageError, match=r"j1\.bin is empty; build it or download it again"):
        read_image(path)
    path.write_bytes(image(1) + bytes(FLASH_SIZE))
    with pytest.raises(ImageError, match=rf"has more than the {FLASH_SIZE} bytes .* flash; take"):
        read_image(path)


def test_images_of_the_firmware_build_are_whole() -> None:
    content = image(3)
    blank = content[:0x210] + b"\xff" * 8 + content[0x218:]
    header = b"\x7fELF\x01\x01".ljust(28, b"\0") + struct.pack("<I10xHH", 52, 32, 1)
    segment = struct.pack("<5I12x", 1, 96, 0x0800_0000, 0x0800_0000, len(blank))
    elf = header.ljust(52, b"\0") + segment.ljust(44, b"\0") + blank
    _, built = runpy.run_path(str(FIRMWARE / "seal.py"))["seal"](elf)
    assert built == content
    Image.from_bytes("j3.bin", built).require(3)


@pytest.mark.parametrize("place", ["checkout", "wheel", "download"])
def test_images_are_found_where_they_are_built_installed_and_downloaded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: str
) -> None:
    module = tmp_path / "src/bioscara/flashing/image.py"
    monkeypatch.setattr(image_file, "__file__", str(module))
    monkeypatch.setattr(image_file, "PACKAGED", module.parent / PACKAGED.name)
    monkeypatch.chdir(tmp_path)
    path = {
        "checkout": tmp_path / "firmware/build/j3.bin",
        "wheel": module.parent / "images/j3.bin",
        "download": Path(f"bioscara-{bioscara.__version__}-j3.bin"),
    }[place]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(image(3))
    assert prebuilt(3) == path


def test_firmware_and_host_of_one_checkout_have_one_version() -> None:
    text = (FIRMWARE / "src/core/version.h").read_text()
    numbers = re.findall(r"kFirmware(?:Major|Minor|Patch) = (\d+);", text)
    assert ".".join(numbers) == bioscara.__version__
