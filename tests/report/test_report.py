"""Statistics, text, page, picture and folder of a run whose errors are known."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pytest

from bioscara.errors import ConfigurationError
from bioscara.report import (
    CycleHistory,
    CycleRecord,
    Outcome,
    Phase,
    RunFolder,
    RunSummary,
    SampleQuality,
    html,
    png,
    text,
)
from bioscara.report.folder import default_path
from bioscara.report.statistics import loop_statistics, tracking

MakeHistory = Callable[[list[CycleRecord]], CycleHistory]


def page_data(page: str) -> dict[str, object]:
    found = re.search(r'<script id="data" type="application/json">(.*?)</script>', page, re.S)
    assert found
    return json.loads(found[1])


def test_a_constant_error_is_its_own_maximum_and_mean(history: CycleHistory) -> None:
    result = tracking(history, 0)
    assert result.samples == 250
    assert result.max_error == pytest.approx(0.002)
    assert result.rms_error == pytest.approx(0.002)
    assert result.final_error == pytest.approx(0.002)


def test_a_single_error_is_found_at_its_time(history: CycleHistory) -> None:
    result = tracking(history, 1)
    assert result.max_error == pytest.approx(0.004)
    assert result.max_error_time == pytest.approx(150 * 0.01 - 0.5 + 0.002)
    assert result.rms_error == pytest.approx(0.004 / 250**0.5)


def test_a_stale_sample_is_counted_and_not_used(
    cycles: list[CycleRecord], make_history: MakeHistory
) -> None:
    joint = cycles[150].joints[1]._replace(quality=SampleQuality.STALE)
    cycles[150] = cycles[150]._replace(joints=(cycles[150].joints[0], joint))
    history = make_history(cycles)
    assert tracking(history, 1).max_error == pytest.approx(0.0, abs=1e-12)
    assert loop_statistics(history).stale == 1


def test_homing_is_not_part_of_the_loop_statistics(
    cycles: list[CycleRecord], make_history: MakeHistory
) -> None:
    homing = [cycle._replace(phase=Phase.HOMING, start=cycle.start - 100) for cycle in cycles]
    loop = loop_statistics(make_history(homing + cycles))
    assert loop.cycles == len(cycles)
    assert loop.period_mean == pytest.approx(0.01)
    assert loop.period_max == pytest.approx(0.01)


def test_a_run_without_any_cycle_can_be_reported(summary: RunSummary, tmp_path: Path) -> None:
    empty = CycleHistory(("j1", "j2"))
    assert "no setpoint was streamed" in text.render(summary, empty)
    assert page_data(html.render(summary, empty))["time"] == []
    png.write(tmp_path / "empty.png", summary, empty)


def test_a_title_is_not_rendered_as_a_formula(
    summary: RunSummary, history: CycleHistory, tmp_path: Path
) -> None:
    png.write(tmp_path / "a.png", replace(summary, title=r"$\frac$ 試薬"), history)
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


def test_the_text_names_the_arm_and_the_outcome(summary: RunSummary, history: CycleHistory) -> None:
    failed = replace(summary, outcome=Outcome.FAILED, message="j2 stalled", faults=("j2 stalled",))
    rendered = text.render(failed, history)
    assert "simulation (in this process)" in rendered
    assert "FAILED: j2 stalled" in rendered
    assert re.search(r"j1 +2\.000 mrad", rendered)
    assert re.search(r"j2 +4\.000 mm", rendered)


def test_text_from_outside_cannot_become_markup(summary: RunSummary, history: CycleHistory) -> None:
    nasty = "</script><script>alert(1)</script>{{data}}"
    named = replace(summary, title=nasty, source=nasty, notes=(nasty,))
    named = replace(named, joints=(replace(named.joints[0], name=nasty), named.joints[1]))
    page = html.render(named, history)
    assert "<script>alert" not in page
    assert page_data(page)["joints"][0]["name"] == nasty  # type: ignore[index]


def test_the_page_loads_no_external_resource(summary: RunSummary, history: CycleHistory) -> None:
    page = html.render(summary, history)
    assert not re.search(r"(?:src|href)\s*=|@import|url\(", page)
    assert "{{" not in re.sub(r"(?s)<script.*?</script>", "", page)


def test_a_long_run_is_thinned_and_keeps_its_worst_cycle(
    summary: RunSummary, many_cycles: list[CycleRecord], make_history: MakeHistory
) -> None:
    history = make_history(many_cycles)
    data = page_data(html.render(summary, history))
    joints = data["joints"]
    assert isinstance(joints, list)
    assert len(joints[1]["error"]) <= html.MAX_POINTS
    assert max(joints[1]["error"]) == pytest.approx(4.0)


def test_a_folder_is_complete(
    tmp_path: Path, summary: RunSummary, history: CycleHistory, cycles: list[CycleRecord]
) -> None:
    folder = RunFolder.create(tmp_path / "new" / "run", history.joint_names, len(cycles))
    folder.samples.write(cycles)
    written, problems = folder.finish(summary, history)
    assert problems == []
    assert {path.name for path in written} == {
        "samples.csv", "report.txt", "plot.html", "plot.png",
    }  # fmt: skip
    assert {path.name for path in folder.path.iterdir()} == {path.name for path in written}


def test_a_folder_with_a_run_is_not_changed(tmp_path: Path) -> None:
    RunFolder.create(tmp_path, ("j1",), 1).samples.close()
    before = (tmp_path / "samples.csv").read_bytes()
    with pytest.raises(ConfigurationError, match=r"holds a run already.*--out"):
        RunFolder.create(tmp_path, ("j1",), 1)
    assert (tmp_path / "samples.csv").read_bytes() == before


@pytest.mark.parametrize("path", ["/proc/run", "/dev/null/run"])
def test_a_folder_that_cannot_be_created_is_refused(path: str) -> None:
    with pytest.raises(ConfigurationError, match=rf"{path} cannot be written.*--out"):
        RunFolder.create(Path(path), ("j1",), 1)


def test_a_disk_without_room_is_refused_and_left_clean(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"has .* MB left and the run needs .* MB"):
        RunFolder.create(tmp_path, ("j1",), 10**15)
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_cannot_be_written_does_not_prevent_the_others(
    tmp_path: Path, summary: RunSummary, history: CycleHistory
) -> None:
    folder = RunFolder.create(tmp_path, history.joint_names, 1)
    (tmp_path / "report.txt").mkdir()
    written, problems = folder.finish(summary, history)
    assert len(problems) == 1
    assert "report.txt was not written" in problems[0]
    assert {"plot.html", "plot.png"} <= {path.name for path in written}
    assert not list(tmp_path.glob("partial-*"))


def test_folders_of_the_same_second_differ(tmp_path: Path) -> None:
    now = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)
    first = default_path(tmp_path, "../a b", now)
    first.mkdir()
    assert first == tmp_path / "20260102-030405-a-b"
    assert default_path(tmp_path, "../a b", now).name == "20260102-030405-a-b-2"
