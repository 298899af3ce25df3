"""Each promise of SECURITY.md names a test that exists."""

from __future__ import annotations

import ast
import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
ROW = re.compile(r"^\| (?!promise|---).* \| (.*) \|$", re.MULTILINE)


def test_each_promise_names_a_test_that_exists() -> None:
    rows = ROW.findall((ROOT / "SECURITY.md").read_text(encoding="utf-8"))
    assert len(rows) > 20
    for row in rows:
        names = re.findall(r"`(tests/\S+\.py)::(\w+)`", row)
        assert names, row
        for path, name in names:
            tree = ast.parse((ROOT / path).read_text(encoding="utf-8"))
            found = {each.name for each in ast.walk(tree) if isinstance(each, ast.FunctionDef)}
            assert name in found, f"{path} has no test {name}"
