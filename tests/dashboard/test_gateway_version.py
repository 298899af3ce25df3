"""A page that is older than its gateway, or not signed in any more, only looks and stops."""

from __future__ import annotations

import pytest
from playwright.sync_api import Page, Route, expect

from bioscara.web.routes.page import VERSION
from dashboard.rig import Site, command, wait_for_state
from processes import wait_until

pytestmark = pytest.mark.realtime


def test_a_page_of_another_version_gives_control_back_and_can_be_loaded_again(
    page: Page, left: Site
) -> None:
    assert page.locator("html").get_attribute("data-assets") == VERSION

    def changed(route: Route) -> None:
        route.fulfill(json={"scope": "operate", "assets": "0123456789abcdef"})

    command(page)
    page.route("**/session", changed)
    # As after a restart of the gateway with another version.
    page.evaluate("bioscara.connection.renew()")
    wait_for_state(page, "mismatch")
    header = page.locator("#identity")
    expect(header).to_contain_text(f"The page is of version {VERSION[:8]}, the server of 01234567.")
    page.wait_for_function("bioscara.connection.open && bioscara.arm.lease.client === null")
    refused = page.evaluate("bioscara.arm.acquire().then(() => '', (error) => error.message)")
    assert refused == "this page has another version than the server: reload it"
    page.unroute("**/session")
    with page.expect_navigation():
        header.get_by_role("button", name="Reload").click()
    wait_for_state(page, "no-lease")


def test_a_page_whose_session_has_ended_says_so_and_asks_no_more(page: Page) -> None:
    page.context.clear_cookies()
    page.evaluate("bioscara.connection.renew()")
    wait_for_state(page, "signed-out")
    wait_until(lambda: page.evaluate("bioscara.connection.ended"), "it does not connect again")
    # The browser itself reports the refused WebSocket.
    page.errors[:] = [error for error in page.errors if "WebSocket" not in error]  # type: ignore[attr-defined]


def test_a_page_is_loaded_again_without_its_files(page: Page) -> None:
    statuses: list[int] = []
    page.on("response", lambda response: statuses.append(response.status))
    page.reload()
    wait_for_state(page, "no-lease")
    sizes = page.evaluate(
        "performance.getEntriesByType('resource').filter((each) => each.name.includes('/js/'))"
        ".map((each) => each.transferSize)"
    )
    assert len(sizes) > 10
    assert sum(sizes) < 1000 * len(sizes), "only headers are sent"
    assert 429 not in statuses
