"""The page of the drivers: its example runs, its tables are those of the code."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from bioscara.drivers import Joint
from bioscara.model import load_parameters

PAGE = Path(__file__).parents[2] / "docs" / "drivers.md"


def test_the_example_runs(capsys: pytest.CaptureFixture[str]) -> None:
    found = re.search(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    assert found is not None
    names: dict[str, object] = {}
    exec(compile(found[1], str(PAGE), "exec"), names)
    assert capsys.readouterr().out.count("FRESH") == 4


def test_the_table_of_functions_is_complete() -> None:
    section = PAGE.read_text().partition("### Functions")[2].partition("###")[0]
    rows = re.findall(r"^\|([^|]*)\|", section, re.M)
    listed = [name for row in rows for name in re.findall(r"`(\w+)\(\)`", row)]
    functions = {
        name for name in dir(Joint) if not name.startswith("_") and callable(getattr(Joint, name))
    }
    assert sorted(listed) == sorted(functions)


def test_reductions_and_limits_on_the_page_are_those_of_the_arm() -> None:
    rows = re.findall(
        r"^\| (j\d) \| (\S+)[^|]*\| (\S+) \| (\S+) \| (\w+) \|", PAGE.read_text(), re.M
    )
    assert [(name, *map(float, numbers), unit) for name, *numbers, unit in rows] == [
        (p.name, pytest.approx(p.reduction, abs=1e-3), p.lower, p.upper, p.unit)
        for p in load_parameters().joints
    ]
