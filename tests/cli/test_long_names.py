"""Names of any length in the arguments: an error is one line of a length that can be read."""

from __future__ import annotations

import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from bioscara.cli import main
from bioscara.printing import LONGEST
from programs import environment

LENGTH = 100_000
COMMANDS = (
    *("NAME", "--NAME", "status NAME", "status --arm NAME", "lease --arm NAME", "events NAME"),
    *("stop NAME", "logs --arm NAME", "home --arm NAME", "home --bus NAME", "home --rate NAME"),
    *("move --name NAME", "move --name NAME --tool NAME", "move --pose NAME 0 0 0", "move --NAME"),
    *("plan --name NAME", "plan --name a --table NAME", "plan --name a --tool NAME", "jog NAME"),
    *("plan --joints 0 0.2 0 0 --scene NAME", "plan --name a --parameters NAME", "gripper NAME"),
    *("run NAME", "run NAME --dry-run", "run a.csv NAME", "view NAME", "view arm:NAME"),
    *("view sim:NAME", "view --name NAME", "view --port NAME", "simulate --socket NAME"),
    *(
        "poses NAME",
        "poses show NAME",
        "poses delete NAME",
        "tools NAME",
        "poses list --table NAME",
    ),
    *("poses save NAME --joints 0 0 0 0 --calibration NAME", "poses save NAME --bus NAME"),
    *("tools add NAME --offset 0 0 0 0 --mass 0", "tools add a --offset 0 0 0 0 --mass NAME"),
    *("serve --name NAME", "serve --bus NAME", "serve --with NAME", "serve --group NAME"),
    *("serve --real-time-factor NAME", "serve --table NAME", "serve --seed NAME", "serve NAME"),
    *("record NAME", "record --arm NAME", "record --max-size NAME", "record info NAME"),
    *("record recover NAME", "record export NAME --csv .", "record replay NAME"),
    *("record replay a.mcap --name NAME", "web --arm NAME", "web --host NAME", "web --show NAME"),
    *("web --port NAME", "web --allowed-host NAME --host NAME", "web --tls-cert NAME", "ros NAME"),
    *("ros --bus NAME --arm NAME", "flash --joint NAME", "flash --joint 1 NAME"),
    *("faults --arm NAME", "joints --bus NAME", "enable --bus NAME", "monitor --arm NAME"),
)
"""Commands that refuse each long name."""
LONG_NAMES = st.text(
    st.characters(exclude_categories=["Cs"], exclude_characters="\0"), min_size=1, max_size=8
).map(lambda text: "x" + (text * LENGTH)[:LENGTH])
"""They begin with a letter: a number would be taken."""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder in which the commands run."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def refused(words: list[str]) -> str:
    """Return the message of a command that is refused."""
    out, err = StringIO(), StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        try:
            status = main(words, paced=False)
        except SystemExit as ended:
            status = int(ended.code or 0)
    assert status in {1, 2}, (words[0], out.getvalue()[:LONGEST])
    return err.getvalue()


@pytest.mark.parametrize("command", COMMANDS)
def test_an_error_does_not_repeat_a_long_name(command: str) -> None:
    check(command, "x" * LENGTH)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(command=st.sampled_from(COMMANDS), name=LONG_NAMES)
def test_an_error_repeats_no_long_name_of_any_characters(command: str, name: str) -> None:
    check(command, name)


def check(command: str, name: str) -> None:
    said = refused([word.replace("NAME", name) for word in command.split()])
    assert said.startswith("bioscara: ")
    # A note may follow.
    assert len(said.splitlines()) <= 2
    assert all(line.isprintable() for line in said.splitlines())
    assert max(map(len, said.splitlines())) <= LONGEST + len("bioscara: ")
    assert list(Path().iterdir()) == []


@pytest.mark.parametrize("words", [["status", "--arm"], ["stop"], ["move", "--name"]])
def test_a_shell_sees_one_line(words: list[str]) -> None:
    command = [sys.executable, "-m", "bioscara", *words, "x" * LENGTH]
    said = subprocess.run(command, capture_output=True, text=True, env=environment(), check=False)
    assert (said.returncode, said.stdout) == (2, "")
    assert len(said.stderr.splitlines()) == 1
    assert "xxx ..." in said.stderr
    assert len(said.stderr) <= LONGEST + len("bioscara: \n")
