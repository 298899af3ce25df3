"""Check a release as its users will get it: ``make release-check``.

It builds everything twice, compares both to the bit, has the usual programs check them
and installs the wheels into new environments outside of the checkout, one for each Python
that it finds, in which ``try_installed.py`` uses them. Packages that they need come from PyPI in
their newest versions, of NumPy, too.
"""

from __future__ import annotations

import hashlib
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from bioscara.version import __version__
from tools import release
from tools.generated import ROOT

PYTHONS = ("3.11", "3.12", "3.13")
"""Versions of Python that are looked for."""
EXTRAS = "sim,plot,web"
_BIN = Path(sys.executable).parent


def main() -> int:
    """Check a release; return the exit status."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            _check(Path(folder))
        except (AssertionError, subprocess.CalledProcessError) as error:
            output = (getattr(error, name, None) or "" for name in ("stdout", "stderr"))
            sys.stderr.write(f"{error}\n{''.join(output)}")
            return 1
    return 0


def _check(folder: Path) -> None:
    dist, again = folder / "dist", folder / "again"
    say("building both distributions, twice")
    release.build(dist)
    release.build(again)
    for path in sorted(dist.iterdir()):
        assert path.read_bytes() == (again / path.name).read_bytes(), (
            f"{path.name} is not the same when it is built again"
        )
    say(f"{len(list(dist.iterdir()))} files, the same to the bit")
    wheels = sorted(dist.glob("*.whl"))
    _judge("twine", "check", "--strict", *sorted(dist.glob("bioscara*.gz")), *wheels)
    _judge("check-wheel-contents", *wheels)
    found = {version: python for version in PYTHONS if (python := python_of(version))}
    for version in sorted({*PYTHONS} - {*found}):
        say(f"not tried, as this computer does not have it: Python {version}")
    assert found, f"none of Python {', '.join(PYTHONS)} is here"
    tried = {}
    for version, python in found.items():
        begun = time.monotonic()
        tried[version] = tried_out(installed(python, dist, folder / version))
        say(f"Python {version}: installed in {time.monotonic() - begun:.0f} s")
    results = {}
    for version, program in tried.items():
        output, _ = program.communicate()
        say(f"Python {version}, in an empty folder\n{output.rstrip()}")
        assert program.returncode == 0, f"it cannot be used with Python {version}"
        results[version] = _result(folder / version / "empty")
    assert len({*results.values()}) == 1, (
        f"samples of the demo or plans are not the same on all of them: {results}"
    )
    say("samples of the demo and all plans are the same to the bit on all of them")


def installed(python: Path, dist: Path, folder: Path) -> Path:
    """Install the wheels into a new environment; return the empty folder next to it.

    Args:
        python: Interpreter for it.
        dist: Folder with the release.
        folder: For the environment; it does not exist yet.
    """
    _run(str(python), "-m", "venv", folder / "env")
    pip = (folder / "env/bin/python", "-m", "pip", "--disable-pip-version-check", "install", "-q")
    _run(*pip, "--find-links", dist, f"bioscara=={__version__}")
    empty = folder / "empty"
    empty.mkdir()
    refused = subprocess.run(
        [folder / "env/bin/bioscara", "demo"],
        cwd=empty,
        capture_output=True,
        text=True,
        check=False,
    )
    wanted = f"pip install 'bioscara[sim]=={__version__}'"
    assert refused.returncode == 2 and wanted in refused.stderr, refused.stderr  # noqa: PT018
    assert not [*empty.iterdir()], "a refused demo left files"
    wheel = _wheel_of_simulation(folder / "env/bin/python", dist, folder)
    if "abi3" in wheel.name:
        _judge("abi3audit", "--strict", wheel)
    _run(*pip, wheel)
    _run(*pip, "--find-links", dist, f"bioscara[{EXTRAS}]=={__version__}")
    return empty


def tried_out(empty: Path) -> subprocess.Popen[str]:
    """Use an installation as a new user would; return the program that does, which waits often.

    Args:
        empty: The folder that :func:`installed` has returned.
    """
    for name in ("try_installed.py", "motion_bits.py"):
        shutil.copy(ROOT / "tools" / name, empty.parent)
    words = (empty.parent / "env/bin/python", empty.parent / "try_installed.py")
    return subprocess.Popen(
        words, cwd=empty, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )


def _result(folder: Path) -> str:
    """Return a checksum of what ``try_installed.py`` has left in a folder."""
    names = ("samples.csv", "plans.txt")
    return hashlib.sha256(b"".join((folder / name).read_bytes() for name in names)).hexdigest()


def _wheel_of_simulation(python: Path, dist: Path, folder: Path) -> Path:
    """Return the wheel for a Python: that of the release, or one built from the same sdist."""
    (sdist,) = dist.glob("bioscara_firmware_sim-*.gz")
    _run(python, "-m", "pip", "wheel", "-q", "--no-deps", "-w", folder / "wheels", sdist)
    (wheel,) = (folder / "wheels").iterdir()
    return wheel


def python_of(version: str) -> Path | None:
    """Return the interpreter of a version of Python, also one of pyenv; None if there is none."""
    of_pyenv = sorted(Path.home().glob(f".pyenv/versions/{version}.*/bin/python"))
    for candidate in (shutil.which(f"python{version}"), *of_pyenv):
        if candidate is not None:
            works = subprocess.run([candidate, "-c", ""], capture_output=True, check=False)
            if works.returncode == 0:
                return Path(candidate)
    return None


def _judge(program: str, *words: object) -> None:
    """Run a program that checks packages."""
    _run(_BIN / program, *words)
    say(f"{program}: passed")


def _run(*words: object) -> None:
    subprocess.run(
        [str(word) for word in words], check=True, capture_output=True, text=True, cwd="/"
    )


def say(text: str) -> None:
    """Print a line at once."""
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
