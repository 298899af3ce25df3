"""The page about the loop lists every fault and its remedy, word by word."""

from __future__ import annotations

from pathlib import Path

import pytest

from bioscara.control.faults.kinds import FaultKind

PAGE = (Path(__file__).parents[3] / "docs" / "loop.md").read_text()


@pytest.mark.parametrize("kind", list(FaultKind))
def test_the_page_says_what_to_do_about_each_fault(kind: FaultKind) -> None:
    (row,) = (line for line in PAGE.splitlines() if line.startswith(f"| {kind.name} |"))
    assert row.endswith(f"| {kind.action} |")
