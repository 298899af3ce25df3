"""Programs that use a bus are named by their script, not by its interpreter."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from bioscara.bus.user import User, in_use, locking_user, user_of

WAIT = "import sys; print(flush=True); sys.stdin.read()"


@pytest.mark.parametrize(
    ("options", "name"),
    [
        (["SCRIPT"], "run.py"),
        (["-u", "-W", "ignore", "-Xdev", "--", "SCRIPT", "-c"], "run.py"),
        (["-uWignore", "SCRIPT", "other.py"], "run.py"),
        (["-m", "package"], "package"),
        (["-um", "package", "-c"], "package"),
        (["package/__main__.py"], "package"),
        (["-c", WAIT, "other.py"], Path(sys.executable).name),
        (["-Bc", WAIT, "other.py"], Path(sys.executable).name),
    ],
)
def test_a_program_has_the_name_that_started_it(
    tmp_path: Path, options: list[str], name: str
) -> None:
    (tmp_path / "package").mkdir()
    for file in (tmp_path / "run.py", tmp_path / "package" / "__main__.py"):
        file.write_text(WAIT)
    words = ["run.py" if word == "SCRIPT" else word for word in options]
    with subprocess.Popen(
        [sys.executable, *words], cwd=tmp_path, stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as program:
        try:
            assert program.stdout
            assert program.stdout.readline() == b"\n"
            assert user_of(program.pid) == (program.pid, name)
        finally:
            program.kill()


def test_a_program_that_ended_or_is_unknown_has_no_name(tmp_path: Path) -> None:
    with subprocess.Popen([sys.executable, "-c", ""]) as program:
        program.wait(10.0)
    assert str(user_of(program.pid)) == f"another program (pid {program.pid})"
    with (tmp_path / "free").open("w") as file:
        assert locking_user(file.fileno()) == User(0, "")
    assert in_use("it", User(0, ""), os.getpid()).startswith("it is used by another program: ")


def test_a_name_cannot_forge_a_line(tmp_path: Path) -> None:
    script = tmp_path / "a\nb\x1b[31m.py"
    script.write_text(WAIT)
    with subprocess.Popen(
        [sys.executable, str(script)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as program:
        try:
            assert program.stdout
            program.stdout.readline()
            assert user_of(program.pid).name == r"a\nb\x1b[31m.py"
        finally:
            program.kill()
