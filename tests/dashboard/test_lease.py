"""The page shows the holder of the lease, takes and gives back control, and reports its loss."""

from __future__ import annotations

import pytest
from playwright.sync_api import BrowserContext, Page

from bioscara.robot.tasks.scope import Scope
from dashboard.rig import Site, at_rest, command, open_page, stays, swing, wait_for_state
from processes import wait_until

pytestmark = pytest.mark.browser


def strip(page: Page) -> str:
    return page.locator("#lease").inner_text()


@pytest.mark.path
def test_control_is_taken_and_given_back_by_a_button(page: Page) -> None:
    assert "Nobody commands the arm" in strip(page)
    page.locator("#lease-take").focus()
    page.keyboard.press("Enter")
    wait_for_state(page, "commanding")
    assert "You command the arm" in strip(page)
    assert "since" in strip(page)
    # The focus stays where it was, on the button that replaces the other one.
    assert page.evaluate("document.activeElement.id") == "lease-give"
    page.keyboard.press("Enter")
    wait_for_state(page, "no-lease")
    assert not page.locator("#lease-lost").is_visible()


def test_a_page_that_loses_control_says_by_whom_and_stops_what_it_began(
    page: Page, left: Site
) -> None:
    command(page)
    left.robot.acquire_lease(force=True)
    wait_for_state(page, "lease-elsewhere")
    banner = page.locator("#lease-lost")
    page.wait_for_function(
        "() => document.querySelector('#lease-lost').textContent.includes('took')"
    )
    assert "took the lease over from dashboard" in banner.inner_text()
    assert page.locator("#lease-take").is_hidden()
    assert page.locator("#lease-over").is_hidden()
    banner.get_by_role("button").click()
    assert not banner.is_visible()
    left.robot.release_lease()


def test_an_administrator_takes_control_over_with_a_reason_that_all_see(
    context: BrowserContext, left: Site
) -> None:
    page = open_page(context, left, Scope.ADMIN)
    swing(left.robot)
    page.get_by_role("button", name="Take over").click()
    dialog = page.get_by_role("dialog")
    assert "comes to rest" in dialog.inner_text()
    page.keyboard.press("Escape")
    dialog.wait_for(state="detached")
    # Escape has stopped the arm, too.
    wait_until(lambda: at_rest(left.robot), "the arm rests")
    swing(left.robot)
    page.get_by_role("button", name="Take over").click()
    page.get_by_label("Reason").fill("<b>sample</b> is spilling")
    page.keyboard.press("Enter")
    wait_for_state(page, "commanding")
    wait_until(lambda: at_rest(left.robot), "the arm rests")
    stays(left.robot)
    page.wait_for_function(
        "() => bioscara.arm.events.some((e) => e.text.includes('<b>sample</b> is spilling'))"
    )


def test_a_page_that_only_looks_has_no_buttons_to_take_control(
    context: BrowserContext, left: Site
) -> None:
    page = open_page(context, left, Scope.VIEW)
    left.robot.acquire_lease(force=True)
    left.robot.release_lease()
    wait_for_state(page, "no-lease")
    assert "no commands" in strip(page)
    for name in ("take", "over", "give"):
        assert page.locator(f"#lease-{name}").is_hidden()


def test_after_a_break_of_the_connection_control_is_asked_for_again(page: Page) -> None:
    command(page)
    page.evaluate("bioscara.connection.socket.close()")
    page.wait_for_selector("#lease-lost:not([hidden])")
    assert "the connection was broken" in page.locator("#lease-lost").inner_text()
    wait_for_state(page, "no-lease", "lease-elsewhere")
