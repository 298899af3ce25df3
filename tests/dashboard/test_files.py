"""Trajectories from files and recordings in the browser: checked, previewed, followed, replayed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page

from dashboard.rig import Site, at_rest, command, page_of, positions, stays, upload
from programs import wait_until
from recording.served_arm import recording
from served import HALF

pytestmark = pytest.mark.browser

GOAL = 0.35
"""Position of j1 at the end of the trajectories [rad]."""


@pytest.fixture(scope="module")
def files(browser: Browser, left: Site) -> Iterator[Page]:
    """Return the panel in a page that commands the arm."""
    with page_of(browser, left, clean=False, accept_downloads=True) as page:
        page.get_by_role("tab", name="Files").click()
        command(page)
        yield page


@pytest.fixture
def panel(files: Page, left: Site) -> Iterator[Page]:
    """Return the panel, and the arm at rest; no error may appear in the console."""
    wait_until(lambda: at_rest(left.robot), "the arm rests")
    yield files
    assert files.errors == []  # type: ignore[attr-defined]


def give(page: Page, text: str, name: str = "swing.csv") -> None:
    upload(page, ".yaml,.yml,.csv", name, text)


def smooth(points: int, duration: float) -> str:
    """Return a motion of j1 that begins and ends at rest, of as many points."""
    rows = ["time,j1_position,j1_velocity"]
    for i in range(points):
        s = i / (points - 1)
        where = HALF[0] + (GOAL - HALF[0]) * s * s * (3 - 2 * s)
        speed = (GOAL - HALF[0]) * 6 * s * (1 - s) / duration
        rows.append(f"{duration * s},{where},{speed}")
    return "\n".join([*rows, ""])


def test_a_long_trajectory_is_read_previewed_and_followed(panel: Page, left: Site) -> None:
    give(panel, smooth(1200, 2.0), "a <b>.csv")
    panel.get_by_text("a <b>.csv: 1200 points, 2.0 s. The arm takes").wait_for()
    assert panel.locator(".motion-plots .plot").count() == 2
    row = panel.get_by_role("row", name="j1").first
    assert "above the limit" not in row.inner_text()
    panel.locator("#panel-files").get_by_role("button", name="Preview").click()
    wait_until(lambda: panel.evaluate("bioscara.preview?.title") == "a <b>.csv", "a preview")
    shown = panel.evaluate("bioscara.preview.trajectory")
    assert shown["joint_names"] == ["j1", "j2", "j3", "j4"]
    assert shown["positions"][0] == pytest.approx(HALF, abs=2e-3)
    panel.locator("#panel-files").get_by_role("button", name="Execute").click()
    panel.get_by_text("The trajectory was followed to its end.").wait_for()
    stays(left.robot)
    assert positions(left.robot)[0] == pytest.approx(GOAL, abs=2e-3)


def test_one_above_the_limits_is_offered_stretched(panel: Page, left: Site) -> None:
    give(panel, smooth(20, 0.02))
    panel.locator(".badge-line", has_text="exceeds the limit").wait_for()
    # It looks disabled and says why.
    panel.locator("#panel-files").get_by_role("button", name="Execute").click(force=True)
    panel.locator("#messages").get_by_text("stretch it to fit").first.wait_for()
    assert at_rest(left.robot)
    panel.get_by_role("button", name="Stretch to fit the limits").click()
    panel.get_by_text("Stretched in time by").wait_for()
    assert panel.locator(".badge-line").is_hidden()
    assert "fit(trajectory, robot.parameters.joints)" in panel.evaluate(
        "document.querySelector('#panel-files .copy-python').python()"
    )


def test_the_sentence_of_the_reader_is_shown(panel: Page) -> None:
    give(panel, "time,j1,j3\n0,0.3,<i>\n1,0.35,0.8\n")
    panel.locator(".badge-line", has_text="swing.csv: line 2: '<i>' is not a number").wait_for()
    assert panel.get_by_role("button", name="Stretch to fit the limits").is_hidden()


def test_a_file_that_is_too_large_is_not_sent(panel: Page) -> None:
    sent: list[str] = []
    panel.on("request", lambda request: sent.append(request.url))
    panel.evaluate(
        """() => {
          const files = new DataTransfer();
          files.items.add(new File([new Uint8Array(100 * 2 ** 20)], "huge.csv"));
          const dropped = new DragEvent("drop", { dataTransfer: files, cancelable: true });
          document.querySelector(".drop").dispatchEvent(dropped);
        }"""
    )
    panel.locator("#messages").get_by_text("huge.csv has 100.0 MiB").first.wait_for()
    assert not [url for url in sent if "trajectories" in url]


def test_following_is_paused_resumed_and_cancelled(panel: Page, left: Site) -> None:
    give(panel, smooth(20, 20.0))
    panel.get_by_text("swing.csv: 20 points, 20.0 s.").wait_for()
    panel.locator("#panel-files").get_by_role("button", name="Execute").click()
    wait_until(lambda: not at_rest(left.robot), "the arm moves")
    pause = panel.locator(".follow-pause")
    pause.get_by_role("button", name="Pause").click()
    wait_until(lambda: panel.evaluate("bioscara.arm.sample.paused"), "it is paused")
    pause.get_by_role("button", name="Resume").click()
    wait_until(lambda: not panel.evaluate("bioscara.arm.sample.paused"), "it is resumed")
    panel.get_by_role("button", name="Cancel the trajectory").click()
    pause.wait_for(state="hidden")
    stays(left.robot)
    assert positions(left.robot)[0] < GOAL + 0.01


def test_a_recording_is_listed_replayed_and_downloaded(
    panel: Page, left: Site, tmp_path: Path
) -> None:
    panel.get_by_text("There is no recording.").wait_for()
    folder = left.folder / "recordings"
    folder.mkdir()
    with recording(folder) as recorder:
        wait_until(
            lambda: any(path.stat().st_size > 4096 for path in folder.glob("*.mcap")), "data"
        )
        (path,) = recorder.end()
    panel.get_by_role("button", name="Refresh the list").click()
    panel.get_by_role("button", name=f"Replay {path.name}").click()
    wait_until(lambda: panel.evaluate("bioscara.preview?.title") == f"Replay {path.name}", "it")
    assert panel.evaluate("bioscara.preview.execute") is None
    here = positions(left.robot)
    shown = panel.evaluate("bioscara.preview.trajectory.positions.at(-1)")
    assert shown == pytest.approx(here, abs=5e-3)
    with panel.expect_download() as download:
        panel.get_by_role("link", name=f"Download {path.name}").click()
    download.value.save_as(tmp_path / "copy.mcap")
    assert (tmp_path / "copy.mcap").read_bytes() == path.read_bytes()
