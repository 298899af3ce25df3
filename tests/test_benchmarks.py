"""``python -m benchmarks``: which topics run, and when the page is written."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType

import pytest
from benchmarks import __main__ as benchmarks
from benchmarks.measure import Row


@pytest.fixture
def page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Two topics, of which the second does not hold, and where they are written."""
    for name, holds in (("swift", True), ("slow", False)):
        module = ModuleType(f"benchmarks.{name}")
        row = Row(f"{name} thing", "1 s", "2 s", "at most 1", holds)
        vars(module)["rows"] = lambda row=row: [row]
        monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.setattr(benchmarks, "TOPICS", {"swift": "Swift things", "slow": "Slow things"})
    monkeypatch.setattr(benchmarks, "PAGE", tmp_path / "page.md")
    return tmp_path / "page.md"


def test_a_topic_alone_is_printed_and_not_written(
    page: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert benchmarks.main(["swift"]) == 0
    out = capsys.readouterr().out
    assert "swift thing" in out
    assert "slow" not in out
    assert not page.exists()


@pytest.mark.parametrize("words", [[], ["slow", "swift"]])
def test_all_topics_are_written_in_their_order(
    words: list[str], page: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert benchmarks.main(words) == 1
    assert capsys.readouterr().err == "does not hold: slow thing\n"
    text = page.read_text()
    assert 0 < text.index("## Swift things") < text.index("## Slow things")


def test_an_unknown_topic_is_refused_before_anything_runs(
    page: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as caught:
        benchmarks.main(["swift", "swit"])
    assert caught.value.code == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "there is no topic 'swit'; did you mean swift?" in err
