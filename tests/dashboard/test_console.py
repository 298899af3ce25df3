"""The console stays clean: wrong inputs are answered on the page."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import BrowserContext, Page, expect

from bioscara.robot.tasks.scope import Scope
from dashboard.rig import Site, command, open_page, upload
from programs import wait_until

pytestmark = pytest.mark.browser

RECORDING = "left-20260101T000000Z.mcap"
FILES = ".yaml,.yml,.csv"


def run(page: Page, _: Site) -> None:
    """Poses out of reach, planned and gone to, an empty field, and a load without a name."""
    go = page.get_by_role("region", name="Go to a pose")
    page.locator("#go-x").fill("3000")
    go.get_by_role("button", name="Preview", exact=True).click()
    expect(page.locator("#messages")).to_contain_text("cannot be reached")
    go.get_by_role("button", name="Go", exact=True).click()
    page.locator("#go-x").fill("")
    go.get_by_role("button", name="Preview", exact=True).click()
    page.locator("summary", has_text="Grasp a load").click()
    page.locator("#load-name").fill("")
    page.get_by_role("button", name="Grasp", exact=True).click(force=True)
    page.locator("#gripper-width").fill("5000")
    page.get_by_role("button", name="Move the jaws").click(force=True)
    expect(page.locator("#messages .error").first).to_be_visible()


def teach(page: Page, _: Site) -> None:
    """Files that are no sequences, a sequence out of reach, a name that is none."""
    head, end = b"schema: 1\ntool: fingers\nsteps: ", b"\n...\n"
    for content in (b"\xff\xfe", head + b"3" + end, head + b"[{kind: wait, seconds: -1}]" + end):
        upload(page, ".yaml,.yml", "wrong.yaml", content)
    expect(page.locator("#messages")).to_contain_text("-1 s is outside")
    page.get_by_role("button", name="Add", exact=True).click()
    field = page.locator(".step-fields input").first
    field.fill("9000")
    field.press("Tab")
    for name in ("Dry run", "Preview", "Save as YAML", "Save as Python"):
        page.locator("#panel-teach").get_by_role("button", name=name, exact=True).click()
    page.locator("#pose-name").fill("9 lives!")
    page.get_by_role("button", name="Save here").click(force=True)


def files(page: Page, _: Site) -> None:
    """Files that are no trajectories, one beyond the limits, and a recording that is damaged."""
    for content in (b"\xff\xfe", b"time,j1\n0,zero\n", b"points: 3\n"):
        upload(page, FILES, "wrong.csv", content)
        expect(page.locator("#panel-files .badge-line.danger")).to_be_visible()
    upload(page, FILES, "quick.csv", b"time,j1,j2,j3,j4\n0,0,0.2,0.8,-0.5\n0.01,1,0.2,0.8,-0.5\n")
    expect(page.get_by_role("button", name="Stretch to fit")).to_be_visible()
    page.get_by_role("button", name=f"Replay {RECORDING}").click()
    expect(page.locator("#messages .error").first).to_contain_text("left-2026")


def settings(page: Page, _: Site) -> None:
    """Values that cannot be used, checked one after the other as they are typed."""
    field = page.get_by_role("textbox", name="joints.j2.upper [m]")
    for typed in ("9", "nine", "-1", ""):
        field.fill(typed)
        page.get_by_role("button", name="Check changes").click()
        expect(page.locator("#panel-settings .notice.danger")).to_be_visible()
    page.get_by_role("button", name="Discard changes").click()


def view(page: Page, _: Site) -> None:
    """A target out of reach."""
    page.get_by_role("button", name="Target", exact=True).click()
    page.locator(".target-row input").first.fill("3000")
    page.locator(".target-row input").first.press("Enter")
    page.locator(".view-target").get_by_role("button", name="Plan", exact=True).click()
    expect(page.locator(".target-refusal")).to_be_visible()
    page.get_by_role("button", name="Target", exact=True).click()


def plain(page: Page, _: Site) -> None:
    """Nothing but a look."""


STOPS: dict[str, Callable[[Page, Site], None]] = {
    "Run": run,
    "Teach": teach,
    "Files": files,
    "Plots": plain,
    "Health": plain,
    "Settings": settings,
    "Simulation": plain,
}
"""The wrong inputs of each tab."""


def test_wrong_inputs_in_each_tab_leave_the_console_clean(
    context: BrowserContext, left: Site
) -> None:
    recordings = left.folder / "recordings"
    recordings.mkdir(exist_ok=True)
    (recordings / RECORDING).write_bytes(b"\x89MCAP0\r\n and no more")
    page = open_page(context, left, Scope.ADMIN)
    answers: list[tuple[int, str]] = []
    page.on("response", lambda answer: answers.append((answer.status, answer.url)))
    view(page, left)
    command(page)
    seen = page.locator("#tabs [role=tab]:visible").all_inner_texts()
    assert seen == [*STOPS]
    for tab, wrong in STOPS.items():
        page.get_by_role("tab", name=tab).click()
        wrong(page, left)
        assert page.errors == [], tab  # type: ignore[attr-defined]
    asked = ("trajectories", "sequences/read", "sequences/plan", "samples", "check")
    assert all(any(path in url for _, url in answers) for path in asked)
    assert [each for each in answers if each[0] >= 400] == []
    wait_until(lambda: not page.errors, "nothing is reported later")  # type: ignore[attr-defined]
