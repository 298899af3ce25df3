"""Files of 1 MiB that no program wrote, and the functions that read files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from bioscara.bus.trace import HEADER, read_trace
from bioscara.drivers.gripper.width_store import read_width
from bioscara.hardware import Urdf
from bioscara.model import load_parameters
from bioscara.planning.files.scene_file import read_scene
from bioscara.planning.files.trajectory_file import read
from bioscara.robot.workspace.teach_file import load_table
from bioscara.robot.workspace.tools import fingers

SIZE = 2**20
TABLE = b"schema: %s\ntools: {}\nposes: {}\n...\n"


def filled(begin: bytes, unit: bytes, end: bytes = b"") -> bytes:
    return begin + unit * ((SIZE - len(begin) - len(end)) // len(unit)) + end


def numbered(begin: bytes, unit: bytes, end: bytes = b"") -> bytes:
    parts, size, count = [begin], len(begin) + len(end), 0
    while size + len(part := unit.replace(b"#", b"%d" % count)) <= SIZE:
        parts.append(part)
        size, count = size + len(part), count + 1
    return b"".join([*parts, end])


BOMB = b"a0: &a0 [x, x, x, x, x, x, x, x, x]\n" + b"".join(
    b"a%d: &a%d [%s]\n" % (level, level, b", ".join([b"*a%d" % (level - 1)] * 9))
    for level in range(1, 12)
)
SHAPES = {
    "brackets": filled(b"schema: ", b"["),
    "closed brackets": filled(b"schema: ", b"[") [: SIZE // 2] + b"]" * (SIZE // 2),
    "100 kB of brackets": b"schema: " + b"[" * 100_000,
    "braces": filled(b"schema: ", b"{"),
    "mappings": filled(b"schema: ", b"{a: "),
    "wrapped brackets": filled(b"schema:\n", b" " + b"[" * 80 + b"\n"),
    "wrapped braces": filled(b"schema:\n", b" " + b"{a: " * 20 + b"\n"),
    "wrapped numbers": filled(b"schema: [\n", b" " + b"1," * 40 + b"\n", b"]\n...\n"),
    "numbers up to the bound": b"schema:\n" + b"- 1\n" * 5_900 + b"...\n",
    "keys up to the bound": b"".join(b"k%d: 1\n" % i for i in range(2_900)) + b"...\n",
    "dashes": filled(b"", b"- "),
    "indents": b"".join(b" " * depth + b"a:\n" for depth in range(1400)),
    "numbers": filled(b"schema: [", b"1,", b"]\n...\n"),
    "numbers in lines": filled(b"schema:\n", b"- 1\n", b"...\n"),
    "floats": filled(b"schema: [", b"1.5e3, ", b"]\n...\n"),
    "long key": filled(b"", b"k", b": 1\n...\n"),
    "many keys": numbered(b"", b"k#: 1\n", b"...\n"),
    "one key": filled(b"", b"k: 1\n", b"...\n"),
    "hex": TABLE % (b"0x" + b"f" * 3700),
    "long hex": filled(b"schema: 0x", b"f", b"\ntools: {}\nposes: {}\n...\n"),
    "octal": filled(b"schema: 0o", b"7", b"\ntools: {}\nposes: {}\n...\n"),
    "binary": filled(b"schema: 0b", b"1", b"\ntools: {}\nposes: {}\n...\n"),
    "digits": filled(b"schema: ", b"9", b"\ntools: {}\nposes: {}\n...\n"),
    "5000 digits": TABLE % (b"9" * 5000),
    "decimals": filled(b"schema: 0.", b"9", b"\ntools: {}\nposes: {}\n...\n"),
    "exponent": TABLE % (b"1e" + b"9" * 1000),
    "sexagesimal": filled(b"schema: 1", b":1", b"\ntools: {}\nposes: {}\n...\n"),
    "underscores": filled(b"schema: 1", b"_", b"\ntools: {}\nposes: {}\n...\n"),
    "aliases": BOMB + b"schema: *a11\n...\n",
    "alias of itself": b"schema: &a [*a]\ntools: {}\nposes: {}\n...\n",
    "many aliases": filled(b"schema: &a 1\nx: [", b"*a,", b"]\n...\n"),
    "merges": numbered(b"m0: &m0 {a: 1}\n", b"n#: {<<: *m0, b: 1}\n", b"...\n"),
    "anchors": numbered(b"", b"k#: &a# 1\n", b"...\n"),
    "documents": filled(b"", b"--- 1\n", b"...\n"),
    "tags": filled(b"schema: ", b"!!x ", b"\n...\n"),
    "comments": filled(b"", b"#\n", b"schema: 1\n...\n"),
    "a comment": filled(b"#", b"x", b"\nschema: 1\n...\n"),
    "text of lines": filled(b"schema: |\n", b"  x\n", b"...\n"),
    "words of lines": filled(b"schema: x\n", b"  x\n", b"...\n"),
    "quotes": filled(b'schema: "', b"\\x", b'"\n...\n'),
    "apostrophes": filled(b"schema: '", b"''", b"'\n...\n"),
    "open quote": filled(b"schema: '", b"x\n"),
    "spaces": filled(b"", b" "),
    "tabs": filled(b"", b"\t"),
    "lines": filled(b"", b"\n"),
    "colons": filled(b"", b":"),
    "questions": filled(b"", b"? "),
    "nothing": b"",
    "bytes": bytes(range(256)) * (SIZE // 256),
    "zeros": bytes(SIZE),
    "a zero": b"schema: 1\0\n...\n",
    "UTF-16": ("schema: 1\n" * 1000).encode("utf-16"),
    "UTF-32": ("schema: 1\n" * 1000).encode("utf-32"),
    "surrogates": b"schema: \xed\xa0\x80\n",
    "escape sequences": b"schema: \"\\e[31m\"\ntools: {}\nposes: {}\n...\n",
    "points": filled(b"joint_names: [j1]\npoints:\n", b"- positions: [1]\n"),
    "values": filled(b"joint_names: [j1]\npoints:\n- positions: [", b"1,", b"]\n---\n"),
    "long value": filled(b"joint_names: [j1]\npoints:\n- positions: [", b"9", b"]\n---\n"),
    "names": filled(b"joint_names: [", b"j1,", b"]\npoints: []\n---\n"),
    "CSV line": filled(b"time,j1_position\n", b"1,"),
    "CSV header": numbered(b"time", b",j#_position", b"\n0,0\n"),
    "CSV number": filled(b"time,j1_position\n0,", b"9", b"\n"),
    "CSV quotes": filled(b"time,j1_position\n0,", b'"', b"\n"),
    "CSV lines": filled(b"time,j1_position\n", b"1,1\n"),
    "CSV open quote": filled(b'time,j1_position\n0,"', b"x\n"),
    "XML": filled(b"<robot name='x'>", b"<a>"),
    "XML closed": b"<robot name='x'>" + b"<a>" * 100_000 + b"</a>" * 100_000 + b"</robot>",
    "XML attributes": numbered(b"<robot ", b"a#='1' ", b"/>"),
    "XML entities": b"<!DOCTYPE r [<!ENTITY a 'x'>]><robot name='&a;'/>",
    "recording": filled(HEADER, b"x"),
    "records": filled(HEADER, b"0 0 - *\n"),
    "JSON": filled(b'{"width": ', b"["),
}  # fmt: skip
ARM = load_parameters()
READERS: dict[str, Callable[[Path], object]] = {
    "poses.yaml": lambda path: load_table(path, fingers(ARM)),
    "parameters.yaml": load_parameters,
    "scene.yaml": read_scene,
    "trajectory.yaml": read,
    "trajectory.csv": read,
    "robot.urdf": Urdf.load,
    "bus.rec": lambda path: list(read_trace(path)),
    "width": lambda path: read_width(path, 0.04, 0.12, 0.08),
}
