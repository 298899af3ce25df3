"""Every command of installation that is shown to a user works."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import get_args

import bioscara_firmware_sim
import pytest
from tools.set_version import versions

from bioscara.extras import Extra, install
from bioscara.version import __version__
from programs import environment

ROOT = Path(__file__).parents[1]


def test_extras_exist_and_are_installed_for_the_python_that_runs() -> None:
    known = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    for extra in get_args(Extra):
        assert extra in known
        words = shlex.split(install(extra))
        assert words == [sys.executable, "-m", "pip", "install", f"bioscara[{extra}]"]


def test_each_locked_package_has_hashes_and_the_version_that_was_tested() -> None:
    pins = re.findall(r"^([\w.-]+)==(\S+)$", (ROOT / "constraints.txt").read_text(), re.MULTILINE)
    tested = {re.sub(r"[._-]+", "-", name).lower(): version for name, version in pins}
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    for name, of in (("demo", ("plot", "web")), ("dev", ("plot", "export", "web", "dev"))):
        entries = re.split(r"\n(?=\S)", (ROOT / "locks" / f"{name}.txt").read_text().strip())
        locked = {}
        for entry in entries:
            found = re.match(r"([a-z0-9-]+)==([^\s;]+)", entry)
            assert found, entry
            assert "--hash=sha256:" in entry, found[1]
            locked[found[1]] = found[2]
        assert {each: locked[each] for each in locked.keys() & tested.keys()} == {
            each: tested[each] for each in locked.keys() & tested.keys()
        }
        wanted = [*project["dependencies"], *(each for extra in of for each in extras[extra])]
        for requirement in wanted:
            found = re.match(r"[\w.-]+", requirement)
            assert found
            assert re.sub(r"[._]+", "-", found[0]).lower() in locked, "run make lock"


def test_no_message_has_a_command_of_its_own() -> None:
    for path in (ROOT / "src").rglob("*.py"):
        found = re.search(r"pip install", path.read_text())
        assert found is None, path


@pytest.mark.parametrize(
    ("found", "said"),
    [
        (
            {"__init__.py": "import bioscara_firmware_sim._native"},
            "the simulated arm is not installed: ",
        ),
        (
            {"__init__.py": "from bioscara_firmware_sim import _native", "_native.so": "\x7fELF"},
            "the simulated arm cannot be loaded, as its installation is damaged or for another "
            "computer (",
        ),
        (
            {"__init__.py": "__version__ = '0.0.9'"},
            f"the simulated arm is version 0.0.9, bioscara {__version__}; install that of the same "
            "version: ",
        ),
    ],
    ids=["none", "damaged", "of another version"],
)
def test_an_unusable_simulation_is_refused_with_the_command_that_installs_it(
    tmp_path: Path, found: dict[str, str], said: str
) -> None:
    package = tmp_path / "packages/bioscara_firmware_sim"
    package.mkdir(parents=True)
    for name, content in found.items():
        (package / name).write_text(content)
    done = subprocess.run(
        [sys.executable, "-m", "bioscara", "demo"],
        cwd=tmp_path,
        env=environment() | {"PYTHONPATH": str(package.parent)},
        capture_output=True,
        text=True,
        check=False,
    )
    *_, line = done.stderr.splitlines()
    assert line.startswith(f"bioscara: {said}")
    assert line.endswith(f" {ROOT / 'firmware'}")
    assert "-m pip install " in line
    assert done.returncode == 2
    assert [path.name for path in tmp_path.iterdir()] == ["packages"]


def test_a_package_that_is_missing_is_named_with_the_command_that_installs_it(
    tmp_path: Path,
) -> None:
    missing = "raise ModuleNotFoundError('none', name='msgspec')"
    (tmp_path / "msgspec.py").write_text(missing)
    done = subprocess.run(
        [sys.executable, "-m", "bioscara", "plan", "--name", "center"],
        env=environment() | {"PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    remedy = f"{sys.executable} -m pip install bioscara=={__version__}"
    assert done.stderr == f"bioscara: msgspec is missing, which it needs: {remedy}\n"
    assert done.returncode == 2


def test_all_that_is_released_together_has_one_version() -> None:
    assert {*versions().values()} == {frozenset({__version__})}
    assert bioscara_firmware_sim.__version__ == __version__
