"""The scripts of ``bioscara completion`` in the shells themselves."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from cli.said import Said
from programs import environment

BASH = """
eval "$(bioscara completion bash)"
COMP_LINE={line}; COMP_POINT=${{#COMP_LINE}}; COMP_TYPE=9
_python_argcomplete bioscara
printf '%s\\n' "${{COMPREPLY[@]}}"
"""
FISH = "bioscara completion fish | source; complete -C {line}"
# It completes nowhere else than at a terminal.
ZSH = (
    'autoload -Uz compinit; compinit -u; eval "$(bioscara completion zsh)"; print $_comps[bioscara]'
)
COMMANDS = {
    "bash": ["bash", "--norc", "-c"],
    "zsh": ["zsh", "-f", "-c"],
    "fish": ["fish", "--no-config", "-c"],
}


@pytest.fixture(params=["bash", "fish"])
def shell(request: pytest.FixtureRequest, said: Said, tmp_path: Path) -> str:
    said.output("poses save plate --joints 0.3 0.1 0.8 -0.4 --table", str(tmp_path / "poses.yaml"))
    return str(request.param)


def run(shell: str, script: str, folder: Path) -> str:
    """Run a script in a shell, in a folder that is its home as well."""
    if shutil.which(shell) is None:
        pytest.skip(f"{shell} is not installed: apt install {shell}")
    path = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
    variables = environment() | {"PATH": path, "TERM": "dumb", "HOME": str(folder)}
    done = subprocess.run(
        [*COMMANDS[shell], script],
        capture_output=True,
        text=True,
        env=variables,
        cwd=folder,
        check=True,
        timeout=60.0,
    )
    return done.stdout


def completions(shell: str, line: str, folder: Path) -> set[str]:
    """Return the words that a shell offers after a line."""
    script = {"bash": BASH, "fish": FISH}[shell].format(line=shlex.quote(line))
    return {each.partition("\t")[0].strip() for each in run(shell, script, folder).splitlines()}


def test_the_shell_completes_commands_options_and_names(shell: str, tmp_path: Path) -> None:
    (tmp_path / "pick.mcap").touch()
    for line, wanted, others in (
        ("bioscara mo", {"move", "monitor"}, {"home"}),
        ("bioscara poses ", {"list", "show", "save", "delete"}, set[str]()),
        ("bioscara move --ve", {"--velocity-scaling"}, {"--name"}),
        ("bioscara move --name ", {"center", "plate"}, {"pick.mcap"}),
        ("bioscara plan --name center --tool ", {"fingers"}, {"plate"}),
        ("bioscara home --joint j", {"j1", "j2", "j3", "j4"}, set[str]()),
        ("bioscara record info pi", {"pick.mcap"}, set[str]()),
    ):
        offered = completions(shell, line, tmp_path)
        assert wanted <= offered, (line, offered)
        assert not others & offered, line


def test_zsh_completes_by_the_script(tmp_path: Path) -> None:
    assert run("zsh", ZSH, tmp_path).split() == ["_python_argcomplete"]


def test_another_shell_is_refused(said: Said) -> None:
    assert "SHELL is one of bash, zsh, fish" in said.refusal("completion tcsh")
