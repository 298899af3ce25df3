"""The images that are flashed: built, sealed, and free of content that a joint must not have."""

from __future__ import annotations

import re
import shutil
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import pytest

import bioscara

ROOT = Path(__file__).parents[2]
JOINT = ROOT / "firmware/joint"
BUILD = ROOT / "firmware/build"
sys.path.insert(0, str(JOINT))

import seal  # noqa: E402
import stack  # noqa: E402

JOINTS = (1, 2, 3, 4)
HEAP = {"malloc", "free", "realloc", "calloc", "_sbrk", "_Znwj", "_ZdlPv"}
EXCEPTIONS = ("__cxa_throw", "_Unwind_", "__cxa_guard_acquire", "typeinfo")


def _symbols(joint: int) -> dict[str, int]:
    listed = subprocess.run(
        ["arm-none-eabi-nm", BUILD / f"j{joint}.elf"], check=True, capture_output=True, text=True
    ).stdout
    fields = (line.split() for line in listed.splitlines())
    return {each[-1]: int(each[0], 16) for each in fields if len(each) == 3}


def _elf(segments: list[tuple[int, bytes]], kind: int = 1) -> bytes:
    """Return a little ELF with these segments (load address, content)."""
    at = 52 + 32 * len(segments)
    headers, contents = b"", b""
    for address, content in segments:
        offset = at + len(contents)
        sizes = (len(content), len(content))
        headers += struct.pack("<8I", kind, offset, address, address, *sizes, 5, 4)
        contents += content
    ident = b"\x7fELF\x01\x01\x01" + bytes(9)
    count = len(segments)
    header = ident + struct.pack("<HHIIIIIHHHHHH", 2, 40, 1, 0, 52, 0, 0, 52, 32, count, 0, 0, 0)
    return header + headers + contents


def _content(size: int = 0x400) -> bytes:
    content = bytearray(index * 7 & 0xFF for index in range(size))
    content[0x200:0x218] = b"BIOSCARA" + bytes([1, 3, 0, 1, 0, 0, 0, 0]) + b"\xff" * 8
    return bytes(content)


def _crc(image: bytes) -> int:
    return zlib.crc32(image[:0x214] + b"\xff\xff\xff\xff" + image[0x218:])


def test_sealing_sets_length_and_crc_in_elf_and_bin_alike() -> None:
    content = _content()
    elf = _elf([(0x0800_0000, content[:0x300]), (0x0800_0310, content[0x310:0x3FE])])
    sealed, image = seal.seal(elf)
    assert len(image) == 0x400  # whole words
    assert image[0x300:0x310] == b"\xff" * 0x10  # a gap is erased flash
    assert image[0x3FE:] == b"\xff\xff"
    assert struct.unpack_from("<II", image, 0x210) == (len(image), _crc(image))
    # The ELF's segments hold the same bytes, and sealing again changes nothing.
    assert seal.seal(sealed) == (sealed, image)
    assert len(sealed) == len(elf)
    assert image[0x200:0x218] in sealed


@pytest.mark.parametrize(
    ("elf", "says"),
    [
        (b"MZ" + bytes(60), "not a 32-bit little-endian ELF"),
        (_elf([(0x0800_0000, bytes(0x400))]), "no identity at offset 0x200"),
        (_elf([(0x0800_0000, _content()[:0x208])]), "no identity at offset 0x200"),
        (_elf([(0x0800_0000, _content()[:0x214])]), "no identity at offset 0x200"),
        (_elf([(0x0800_4000, _content())]), "nothing is loaded at 0x08000000"),
        (_elf([(0x2000_0000, b"data"), (0x0000_0000, b"low")]), "below the flash"),
        (_elf([(0x0800_0000, _content())], kind=2), "nothing is loaded at 0x08000000"),
    ],
)
def test_what_is_no_image_is_not_sealed(elf: bytes, says: str) -> None:
    with pytest.raises(ValueError, match=says):
        seal.seal(elf)


LISTING = """\
08000000 <reset_handler>:
 8000000:\tb508      \tpush\t{r3, lr}
 8000002:\tf000 f8c6 \tbl\t8000010 <program>
 8000006:\t4798      \tblx\tr3

08000010 <program>:
 8000010:\te92d 41f0 \tstmdb\tsp!, {r4, r5, r6, r7, r8, lr}
 8000014:\ted2d 8b04 \tvpush\t{d8-d9}
 8000018:\tb08a      \tsub\tsp, #40\t@ 0x28
 800001a:\td1fa      \tbne.n\t8000010 <program+0x4>
 800001c:\tf000 b933 \tb.w\t8000020 <leaf>

08000020 <leaf>:
 8000020:\tf84d 4d10 \tstr.w\tr4, [sp, #-16]!
 8000024:\t4770      \tbx\tlr

08000030 <bioscara::Board::micros()>:
 8000030:\tf5ad 7d00 \tsub.w\tsp, sp, #512\t@ 0x200
 8000034:\t4770      \tbx\tlr
"""


def test_the_stack_of_a_chain_of_calls_is_the_sum_of_what_it_pushes() -> None:
    functions = stack.parse(LISTING)
    assert stack.deepest(functions, "leaf") == 16
    assert stack.deepest(functions, "program") == 24 + 16 + 40 + 16
    # Through a pointer it may reach the board's functions.
    assert stack.deepest(functions, "reset_handler") == 8 + 512


@pytest.mark.parametrize(
    ("line", "says"),
    [
        (" 8000022:\tf000 f8c6 \tbl\t8000010 <program>", "can call itself"),
        (" 8000022:\tf000 f8c6 \tbl\t8000090 <elsewhere>", "elsewhere is called and not in"),
        (" 8000022:\tebad 0d03 \tsub.w\tsp, sp, r3", "takes a computed amount"),
    ],
)
def test_a_stack_without_bound_is_an_error(line: str, says: str) -> None:
    listing = LISTING.replace(" 8000024:\t4770      \tbx\tlr", line, 1)

    def add_up() -> None:
        stack.deepest(stack.parse(listing), "program")

    with pytest.raises(ValueError, match=says):
        add_up()


@pytest.mark.parametrize("joint", JOINTS)
def test_an_image_says_what_it_is_and_that_it_is_whole(images: str, joint: int) -> None:
    image = (BUILD / f"j{joint}.bin").read_bytes()
    magic, form, number, *version, length, crc = struct.unpack_from("<8s5B3xII", image, 0x200)
    assert (magic, form, number) == (b"BIOSCARA", 1, joint)
    # The host's version, which HELLO answers too (without the patch).
    assert version == [int(part) for part in bioscara.__version__.split(".")]
    assert (length, crc) == (len(image), _crc(image))
    assert len(image) <= 64 * 1024
    assert seal.seal((BUILD / f"j{joint}.elf").read_bytes())[1] == image
    assert (BUILD / f"j{joint}.map").stat().st_size > 0


def test_the_images_differ_by_the_joint_alone(images: str) -> None:
    first, *others = ((BUILD / f"j{joint}.bin").read_bytes() for joint in JOINTS)
    for other in others:
        assert len(other) == len(first)
        # The identity's number and CRC, and the words of the configuration.
        assert sum(a != b for a, b in zip(first, other, strict=True)) <= 5 + 12


@pytest.mark.parametrize("joint", JOINTS)
def test_an_image_has_no_heap_no_exceptions_and_no_double_arithmetic(
    images: str, joint: int
) -> None:
    symbols = _symbols(joint)
    assert not HEAP & set(symbols)
    assert not [name for name in symbols if name.startswith(EXCEPTIONS)]
    assert not [name for name in symbols if name.startswith("__aeabi_d")]


@pytest.mark.parametrize("joint", JOINTS)
def test_an_image_rounds_as_the_simulation_does(images: str, joint: int) -> None:
    """As tests/firmware/test_emulated_bits.py sees in the runs that it tries."""
    command = ["arm-none-eabi-objdump", "-d", str(BUILD / f"j{joint}.elf")]
    listing = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    assert re.search(r"\tvmul\.f32\t", listing)
    assert not re.search(r"\tvfn?m[as]\.f32\t", listing)
    inexact = re.compile(r"(__ieee754_|__kernel_)?(a?(sin|cos|tan)h?|atan2|exp|log|pow|cbrt)f?")
    assert not [name for name in _symbols(joint) if inexact.fullmatch(name)]


@pytest.mark.parametrize("joint", JOINTS)
def test_the_vector_table_leads_into_the_first_block_of_the_flash(images: str, joint: int) -> None:
    image = (BUILD / f"j{joint}.bin").read_bytes()
    symbols = _symbols(joint)
    initial, *handlers = struct.unpack_from("<101I", image)
    assert initial == symbols["stack_top"] == 0x2000_1000
    fault = symbols["fault_handler"] | 1
    tick, i2c = symbols["control_tick_handler"] | 1, symbols["i2c_handler"] | 1
    # Exceptions 1..15, then interrupts: TIM3 is 29, I2C1 31 and 32.
    expected = [fault] * 100
    expected[0] = symbols["reset_handler"] | 1
    expected[15 + 29], expected[15 + 31], expected[15 + 32] = tick, i2c, i2c
    assert handlers == expected
    # Code that runs before the check of the image survives a flashing that stops after 2 KiB.
    functions = stack.parse(
        subprocess.run(
            ["arm-none-eabi-objdump", "-d", BUILD / f"j{joint}.elf"],
            check=True,
            capture_output=True,
            text=True,
        ).stdout
    )
    early = ("image_intact", "open_power_stage", "light_up", "9requestedEv", "5enterEv")
    names = {name for name in symbols if any(part in name for part in early)}
    assert len(names) == len(early)
    # ... and all that they call.
    names |= {"fault_handler"}
    while more := {each for name in names for each in functions[name].calls if each} - names:
        names |= more
    assert "open_and_reset" in names
    for name in ("reset_handler", *names):
        assert symbols[name] < 0x0800_0800, name


def test_the_build_reports_sizes_and_stack(images: str) -> None:
    assert images.count("exception frames") == len(JOINTS)
    assert all(f"j{joint}.elf" in images for joint in JOINTS)


def test_a_stack_above_what_is_reserved_fails_the_build(
    images: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(stack, "EXCEPTION_FRAME", 4096)
    assert stack.main(str(BUILD / "j1.elf")) == 1
    assert "bytes of stack, the linker script has 4096" in capsys.readouterr().err


def test_a_missing_compiler_is_named_with_its_packages(tmp_path: Path) -> None:
    make = shutil.which("make")
    if make is None:
        pytest.skip("make is not installed")
    done = subprocess.run(
        [make, "-C", str(JOINT), "PREFIX=no-such-", f"BUILD={tmp_path}"],
        check=False,
        capture_output=True,
        text=True,
    )
    assert done.returncode != 0
    assert "no-such-g++ is missing" in done.stderr
    assert "apt install gcc-arm-none-eabi libnewlib-arm-none-eabi" in done.stderr
