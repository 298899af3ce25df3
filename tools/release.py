"""Build a release: ``python -m tools.release FOLDER``, or ``make dist``.

A release is: the sdist of each distribution, the wheel that is built from it, the images of the
joints (the wheel of bioscara contains them, too), and SHA256SUMS. Only files that git tracks are
packed. Every file gets the time of the last commit, so that two builds are equal.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

from bioscara.flashing.image import JOINTS, PACKAGED, released_name
from tools.generated import ROOT


def build(out: Path) -> None:
    """Build a release into a folder, which is emptied before.

    Args:
        out: The folder.

    Raises:
        FileNotFoundError: An image of a joint was not built.
        subprocess.CalledProcessError: A build failed; its output says why.
    """
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    with tempfile.TemporaryDirectory() as folder:
        sources = Path(folder) / "sources"
        for name in _git("ls-files", "-z").split("\0"):
            if name and (ROOT / name).is_file():
                (sources / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(ROOT / name, sources / name)
        images = sources / PACKAGED.relative_to(ROOT)
        images.mkdir()
        for joint in JOINTS:
            shutil.copy(ROOT / f"firmware/build/j{joint}.bin", images)
            shutil.copy(images / f"j{joint}.bin", out / released_name(joint))
        _write_sums(images)
        for project in (sources, sources / "firmware"):
            subprocess.run(
                (sys.executable, "-m", "build", "--outdir", str(out.absolute()), str(project)),
                env={
                    **os.environ,
                    "SOURCE_DATE_EPOCH": _git("log", "-1", "--format=%ct").strip(),
                    "PIP_CONSTRAINT": str(ROOT / "constraints.txt"),
                },
                capture_output=True,
                text=True,
                check=True,
            )
    _write_sums(out)


def _git(*words: str) -> str:
    return subprocess.run(
        ("git", *words), cwd=ROOT, check=True, capture_output=True, text=True
    ).stdout


def _write_sums(folder: Path) -> None:
    """Write SHA256SUMS of the files in a folder, as ``sha256sum --check`` reads it."""
    files: Iterable[Path] = sorted(folder.iterdir())
    lines = [f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}\n" for path in files]
    (folder / "SHA256SUMS").write_text("".join(lines))


if __name__ == "__main__":
    build(Path(sys.argv[1]))
    sys.stdout.write((Path(sys.argv[1]) / "SHA256SUMS").read_text())
