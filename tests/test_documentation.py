"""The documentation is correct: its programs run, its commands print the text shown there."""

from __future__ import annotations

import re
import shlex
import shutil
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import NamedTuple

import pytest

from bioscara import Robot
from bioscara.cli import main
from bioscara.server.serve import ServeSettings, serving
from programs import wait_until

pytestmark = pytest.mark.thorough

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
ELSEWHERE = re.compile(r"demo|jog|run .*--|move --name|simulate|view|.* --bus ")
"""Commands that home an arm, serve others or read a real bus: their output differs each time."""


class Shown(NamedTuple):
    """A command and the output shown below it."""

    words: str
    lines: tuple[str, ...]


def _programs() -> list[tuple[str, str]]:
    return [
        (f"{page.name}-{number}", program)
        for page in PAGES
        for number, program in enumerate(re.findall(r"```python\n(.*?)```", page.read_text(), re.S))
    ]


def _shown() -> list[Shown]:
    text = (ROOT / "docs/commands.md").read_text()
    block = r"^    \$ bioscara (.*)\n((?:    (?!\$).*\n|\n(?=    (?!\$)))*)"
    return [
        Shown(words, tuple(line[4:] for line in below.splitlines()))
        for words, below in re.findall(block, text, re.M)
        if not ELSEWHERE.match(words)
    ]


def _pattern(lines: tuple[str, ...]) -> str:
    """``...`` alone stands for any lines, ``..`` at the end for the rest of a line."""
    parts = []
    for line in lines:
        if line == "...":
            parts.append(r"(?:.*\n)*")
        elif line.endswith(".."):
            parts.append(re.escape(line.rstrip(".")) + r".*\n")
        else:
            parts.append(re.escape(line) + r" *\n")
    return "".join(parts)


@pytest.mark.usefixtures("near_the_stops")
@pytest.mark.parametrize(
    "program", [pytest.param(program, id=name) for name, program in _programs()]
)
def test_a_program_in_the_documentation_runs(
    program: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    with ExitStack() as served:
        for name in re.findall(r'"arm:(\w+)"', program):
            settings = ServeSettings(name, "sim", real_time_factor=100.0)
            served.enter_context(serving(Robot.simulated(), settings))
        exec(compile(program, "documentation", "exec"), {"__name__": "__main__"})


@pytest.mark.usefixtures("near_the_stops")
def test_the_commands_that_provoke_a_fault_recover_from_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    part = (ROOT / "docs/howto.md").read_text().split("## Provoke a fault and recover")[1]
    commands = re.findall(r"^    bioscara (.*?)  ", part.split("\n## ")[0], re.M)
    assert commands[0] == "serve --homed"
    robot = Robot.simulated(homed=True, evidence=tmp_path)
    with serving(robot, ServeSettings("arm", "sim", real_time_factor=100.0)):
        with Robot.connect("arm:arm") as client:
            client.enable()
        for words in commands[1:]:
            assert main(shlex.split(words), paced=False) == 0, words
            if words.startswith("simulate-fault hang"):
                wait_until(lambda: robot.faults != (), "the fault")
        assert robot.faults == ()
        assert robot.is_homed


def test_commands_say_what_the_documentation_shows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    for file in (ROOT / "tests/data").iterdir():
        shutil.copy(file, tmp_path)
    scene = (tmp_path / "examples/scene.yaml").read_text()
    (tmp_path / "mistake.yaml").write_text(scene.replace("radius", "radus"))
    monkeypatch.chdir(tmp_path)
    shown = _shown()
    assert len(shown) > 15
    for words, lines in shown:
        with suppress(SystemExit):  # wrong usage
            main(shlex.split(words), paced=False)
        said = capsys.readouterr()
        assert re.fullmatch(_pattern(lines), said.out + said.err), f"{words}\n{said.out}{said.err}"
