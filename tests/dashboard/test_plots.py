"""Plots of the time before the page was opened and of new samples, and their export."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from dashboard.rig import Site, page_of, site
from programs import wait_until
from served import HALF

pytestmark = pytest.mark.browser

JOINTS = ("j1", "j2", "j3", "j4")

COUNT_LINES = """() => {
    const { stroke } = CanvasRenderingContext2D.prototype;
    window.lines = 0;
    CanvasRenderingContext2D.prototype.stroke = function (...words) {
        if (this.canvas.closest(".plot")) window.lines += 1;
        return stroke.apply(this, words);
    };
}"""


@pytest.fixture(scope="module")
def page(browser: Browser, left: Site) -> Iterator[Page]:
    """Return a page, opened after the arm has moved, which the tests share."""
    left.robot.move_joints((HALF[0] + 0.3, *HALF[1:]))
    left.robot.move_joints(HALF)
    with page_of(browser, left) as opened:
        opened.get_by_role("tab", name="Plots").click()
        expect(opened.locator(".plot canvas").first).to_be_visible()
        expect(opened.locator(".plot canvas")).to_have_count(len(opened.locator(".plot").all()))
        yield opened


def table(page: Page) -> dict[str, list[float]]:
    """Return the values in view, as the page saves them."""
    with page.expect_download() as download:
        page.get_by_role("button", name="Save CSV").click()
    with Path(download.value.path()).open(newline="") as file:
        rows = list(csv.DictReader(file))
    return {name: [float(row[name] or "nan") for row in rows] for name in rows[0]}


def test_the_plots_begin_before_the_page_was_opened(page: Page, left: Site) -> None:
    found = table(page)
    time, turned = found["time [s]"], found["j1 position [rad]"]
    assert max(turned) == pytest.approx(HALF[0] + 0.3, abs=2e-3)
    assert time == sorted(time)
    assert turned[-1] == pytest.approx(left.robot.state.positions[0], abs=1e-4)
    speeds = [value for value in found["j1 velocity [rad/s]"] if not math.isnan(value)]
    assert max(map(abs, speeds)) > 0.1
    assert 1e-3 < max(found["bus [s]"]) < 0.01
    for joint in JOINTS:
        loads = found[f"{joint} load [%]"]
        assert not any(map(math.isnan, loads)), joint
        assert 0.0 <= min(loads) <= max(loads) <= 255.0
    assert min(found["j1 load [%]"]) < max(found["j1 load [%]"])
    wait_until(lambda: table(page)["time [s]"][-1] > time[-1], "it goes on")


def test_a_push_is_seen_as_the_load_of_its_joint(page: Page, left: Site) -> None:
    def newest() -> list[float]:
        found = table(page)
        return [found[f"{joint} load [%]"][-1] for joint in JOINTS]

    before = newest()
    left.robot.simulate_fault("push", "j1", 1.5)
    wait_until(lambda: newest()[0] > before[0] + 8.0, "the load of j1 in the plot")
    assert newest()[1:] == pytest.approx(before[1:], abs=5)
    left.robot.simulate_fault("push", "j1", 0.0)
    expect(page.get_by_text("No load of")).to_have_count(0)


def test_joints_without_load_are_named_and_their_lines_are_gaps(browser: Browser) -> None:
    with site(original="j2 j4") as made:
        with page_of(browser, made) as opened:
            opened.get_by_role("tab", name="Plots").click()
            expect(opened.get_by_text("No load of j2, j4: original firmware")).to_be_visible()
            found = table(opened)
        gaps = [all(map(math.isnan, found[f"{joint} load [%]"])) for joint in JOINTS]
        assert gaps == [False, True, False, True]


def test_a_pause_holds_what_is_seen_and_a_drag_zooms(page: Page) -> None:
    page.get_by_role("button", name="Pause").click()
    held = table(page)["time [s]"]
    box = page.locator(".plot .u-over").first.bounding_box()
    assert box is not None
    middle = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + box["width"] * 0.90, middle)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] * 0.95, middle, steps=4)
    page.mouse.up()
    seen = table(page)["time [s]"]
    assert seen[-1] - seen[0] == pytest.approx(0.05 * 60, rel=0.1)
    assert held[0] <= seen[0]
    assert seen[-1] <= held[-1]
    page.get_by_role("button", name="Zoom out").click()
    wider = table(page)["time [s]"]
    # Twice as wide, unless the rows that are kept end before.
    assert 1.3 < (wider[-1] - wider[0]) / (seen[-1] - seen[0]) < 2.3
    page.get_by_role("button", name="Continue").click()
    assert table(page)["time [s]"][-1] > held[-1]


def test_only_what_is_chosen_is_plotted_and_saved(page: Page) -> None:
    joint, velocity = page.get_by_label("j2", exact=True), page.get_by_label("Velocity", exact=True)
    joint.uncheck()
    velocity.uncheck()
    names = set(table(page))
    assert "j1 position [rad]" in names
    assert not any("j2" in name or "velocity" in name for name in names)
    joint.focus()
    page.keyboard.press("Space")
    velocity.check()
    assert {"j2 position [m]", "j2 velocity [m/s]"} <= set(table(page))
    with page.expect_download() as download:
        page.get_by_role("button", name="Save PNG").click()
    assert Path(download.value.path()).read_bytes().startswith(b"\x89PNG")


def test_plots_that_are_not_seen_are_not_drawn(page: Page) -> None:
    page.evaluate(COUNT_LINES)
    wait_until(lambda: page.evaluate("window.lines") > 20, "the plots are drawn")
    page.get_by_role("tab", name="Health").click()
    page.evaluate("window.lines = 0")
    page.wait_for_timeout(500)
    assert page.evaluate("window.lines") == 0
    page.get_by_role("tab", name="Plots").click()
    wait_until(lambda: page.evaluate("window.lines") > 20, "the plots are drawn")
