"""Parameters on the page: searched, changed after a look at the difference, saved, undone."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from bioscara.robot.tasks.scope import Scope
from dashboard.rig import Site, command, page_of

pytestmark = pytest.mark.browser

REDUCTION = "joints.j1.reduction"


@pytest.fixture(scope="module")
def page(browser: Browser, left: Site) -> Iterator[Page]:
    """Return a page of an administrator, which the tests share."""
    with page_of(browser, left, Scope.ADMIN, clean=False) as opened:
        opened.get_by_role("tab", name="Settings").click()
        command(opened)
        yield opened


def change(page: Page, name: str, value: str) -> None:
    """Type a value and let the changes be checked."""
    page.locator(f'.settings-table input[aria-label^="{name}"]').fill(value)
    page.get_by_role("button", name="Check changes").click()


def discard(page: Page) -> None:
    """Give all changes up."""
    page.get_by_role("button", name="Discard changes").click()


def test_a_value_that_cannot_be_used_is_refused_with_its_limit(page: Page, left: Site) -> None:
    change(page, "joints.j1.max_velocity", "1e9")
    problem = page.locator("#panel-settings [role=alert]")
    expect(problem).to_contain_text("joints.j1.max_velocity: 1e+09 is outside")
    expect(page.get_by_role("button", name="Save", exact=True)).to_have_count(0)
    assert left.robot.overlay().overlay == ""
    discard(page)
    expect(problem).to_be_hidden()


def test_changes_are_seen_saved_and_undone(page: Page, left: Site) -> None:
    change(page, REDUCTION, "35.2")
    changes = page.get_by_role("region", name="Changes").first
    expect(changes.locator("del")).to_have_text("35")
    expect(changes.locator("ins")).to_have_text("35.2")
    assert left.robot.overlay().overlay == ""
    page.get_by_role("button", name="Save", exact=True).click()
    expect(page.get_by_text("Its values apply from the next start")).to_be_visible()
    assert "35.2" in left.robot.overlay().overlay
    row = page.locator(".settings-table tr", has=page.locator(f'input[aria-label="{REDUCTION}"]'))
    expect(row.locator(".badge")).to_have_text("this arm")
    page.get_by_label("Only values of this arm").check()
    expect(page.locator(".settings-table tbody tr:visible")).to_have_count(1)
    page.get_by_label("Only values of this arm").uncheck()
    with page.expect_download() as download:
        page.get_by_role("button", name="Download overlay").click()
    assert Path(download.value.path()).read_text() == left.robot.overlay().overlay
    page.get_by_role("button", name="Undo last save").click()
    expect(row.locator(".badge")).to_have_text("default")
    assert left.robot.overlay().overlay == ""
    expect(page.get_by_role("button", name="Undo last save")).to_be_disabled()


def test_another_client_that_was_faster_is_a_conflict_and_the_edits_stay(
    page: Page, left: Site
) -> None:
    change(page, REDUCTION, "35.3")
    expect(page.get_by_role("button", name="Save", exact=True)).to_be_enabled()
    robot = left.robot
    robot.acquire_lease(force=True)
    robot.set_overlay("gripper: {deg_per_m: 3310.0}\n", robot.overlay().revision)
    expect(page.locator("#panel-settings [role=alert]")).to_contain_text("Another client")
    expect(page.get_by_role("button", name="Save", exact=True)).to_have_count(0)
    robot.release_lease()
    command(page)
    page.get_by_role("button", name="Check changes").click()
    page.get_by_role("button", name="Save", exact=True).click()
    expect(page.get_by_role("button", name="Check changes")).to_be_disabled()
    assert "35.3" in robot.overlay().overlay
    assert "3310" in robot.overlay().overlay


def test_an_operator_reads_why_nothing_can_be_changed(browser: Browser, left: Site) -> None:
    with page_of(browser, left, size=(390, 844)) as page:
        page.get_by_role("tab", name="Settings").click()
        page.get_by_label("Search in parameters").fill("J2 reduction")
        rows = page.locator(".settings-table tbody tr:visible")
        expect(rows).to_have_count(1)
        expect(rows.locator("input")).to_be_disabled()
        expect(page.locator("#panel-settings")).to_contain_text("sign in as an administrator")
