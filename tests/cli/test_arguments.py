"""Parsing of the command line: options or a clear refusal, without slow imports."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from bioscara import __version__
from bioscara.cli import main
from bioscara.cli.arguments import parse


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        ([], "COMMAND"),
        (["dance"], "invalid choice: 'dance'"),
        (["run"], "FILE"),
        (["run", "a.csv", "b.csv"], "b.csv"),
        (["run", "a.csv", "--fi"], "--fi"),
        (["demo", "--out"], "--out"),
        (["simulate"], "--socket"),
        (["simulate", "--socket", "s", "--seed", "many"], "--seed"),
        (["demo", "--v1", "--bus", "linux:1"], "--v1"),
    ],
)
def test_wrong_usage_names_the_word(
    words: list[str], complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as caught:
        main(words)
    assert caught.value.code == 2
    assert complaint in capsys.readouterr().err


def test_the_simulated_arm_is_the_default() -> None:
    options = parse(["run", "a.csv"])
    assert options.bus == "sim"
    assert options.file == Path("a.csv")
    assert options.out is None
    assert (options.fit, options.realtime, options.v1) == (False, False, False)


def test_the_version_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["--version"])
    assert caught.value.code == 0
    assert __version__ in capsys.readouterr().out


def test_help_imports_nothing_heavy() -> None:
    code = (
        "import sys\n"
        "from bioscara.cli.arguments import parse\n"
        "try: parse(['run', '--help'])\n"
        "except SystemExit: pass\n"
        "heavy = {'numpy', 'rich', 'ruamel', 'matplotlib', 'yaml', 'asyncio'}\n"
        "print(*(heavy & set(sys.modules)), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "FILE" in done.stdout
    assert done.stderr.split() == []
