"""The start page with all arms; and pages that are older than their gateway, or not signed in."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import BrowserContext, Page, Route, expect

from bioscara.robot.tasks.scope import Scope
from bioscara.web.routes.page import VERSION
from dashboard.rig import Site, at_rest, command, wait_for_state
from programs import wait_until
from web.gateways import arm

pytestmark = pytest.mark.browser


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
    page.wait_for_function("() => bioscara.connection.open && bioscara.arm.lease.client === null")
    refused = page.evaluate("bioscara.arm.acquire().then(() => '', (error) => error.message)")
    assert refused == "this page has another version than the server: reload it"
    page.unroute("**/session")
    with page.expect_navigation():
        header.get_by_role("button", name="Reload").click()
    wait_for_state(page, "no-lease")


def test_a_page_that_a_restart_has_signed_out_does_not_say_that_stop_works(page: Page) -> None:
    page.context.clear_cookies()
    page.route("**/session", lambda route: route.fulfill(json={"scope": "", "assets": "0123"}))
    page.evaluate("bioscara.connection.renew()")
    wait_for_state(page, "signed-out")
    expect(page.locator("#identity")).to_contain_text("Open the address with the token again.")
    # The browser itself reports the refused requests.
    page.errors[:] = [each for each in page.errors if "401" not in each and "WebSocket" not in each]  # type: ignore[attr-defined]


def test_a_page_whose_session_has_ended_says_so_and_asks_no_more(page: Page) -> None:
    page.context.clear_cookies()
    page.evaluate("bioscara.connection.renew()")
    wait_for_state(page, "signed-out")
    wait_until(lambda: page.evaluate("bioscara.connection.ended"), "it does not connect again")
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))

    def quiet() -> bool:
        asked.clear()
        page.wait_for_timeout(1000)
        return asked == []

    wait_until(quiet, "it asks no more")
    # The browser itself reports a refused WebSocket, and requests that were on their way (401).
    refused = ("WebSocket", "401")
    page.errors[:] = [each for each in page.errors if not any(word in each for word in refused)]  # type: ignore[attr-defined]


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


@pytest.fixture
def arms(context: BrowserContext, left: Site) -> Iterator[Page]:
    """The start page, signed in to look."""
    opened = context.new_page()
    errors: list[str] = []
    opened.on("pageerror", lambda error: errors.append(str(error)))
    opened.goto(left.url_for(Scope.VIEW).replace("/#", "/arms.html#"))
    wait_for_state(opened, "live")
    yield opened
    assert errors == []


def test_all_arms_are_listed_and_stopped_by_one_button_or_escape(
    arms: Page, left: Site, tmp_path: Path
) -> None:
    assert "token" not in arms.url
    with arm("right", tmp_path) as served:
        expect(arms.get_by_role("heading", level=2)).to_have_text(["left", "right"])
        right = arms.get_by_role("listitem").filter(has_text="right")
        expect(right).to_contain_text("SIMULATED")
        expect(right).to_contain_text("bioscara web --arm right")
        arms.get_by_role("button", name="STOP right", exact=True).click()
        expect(right.get_by_role("alert")).to_have_text("right was stopped")
        first = arms.get_by_role("listitem").first
        expect(first.locator(".result")).to_be_hidden()
        operation = left.robot.move_joints((-1.0, 0.2, 0.8, -0.5), wait=False)
        expect(first).to_contain_text("moving:")
        arms.keyboard.press("Escape")
        expect(first.get_by_role("alert")).to_have_text("left was stopped")
        wait_until(lambda: at_rest(left.robot), "it comes to rest")
        wait_until(lambda: operation.done, "its goal has ended")
        assert served.owner.events.last > 0
    expect(arms.get_by_role("heading", level=2)).to_have_text(["left"])


@pytest.mark.path
def test_each_arm_links_to_its_page_and_the_page_back(arms: Page, left: Site) -> None:
    arms.get_by_role("link", name="Open left").click()
    wait_for_state(arms, "no-lease", "lease-elsewhere")
    arms.get_by_role("link", name="All arms").click()
    wait_for_state(arms, "live")


def test_a_stop_that_is_not_confirmed_says_so_and_is_sent_again(arms: Page, left: Site) -> None:
    sent = []

    def refused(route: Route) -> None:
        sent.append(route.request.url)
        if len(sent) == 1:
            route.abort()
        else:
            route.continue_()

    arms.route("**/api/arms/stop", refused)
    alert = arms.get_by_role("listitem").first.get_by_role("alert")
    arms.get_by_role("button", name="STOP ALL").press("Enter")
    expect(alert).to_have_text("STOP of left is NOT CONFIRMED: use the emergency stop.")
    expect(alert).to_have_text("left was stopped")
    assert len(sent) == 2


def test_names_with_markup_are_shown_as_text_and_old_states_as_unknown(arms: Page) -> None:
    name = "<img src=x onerror=alert(1)>\u202e\x1b"
    state = {"fault": "clear", "stale": False, "paused": False, "moving": [name], "enabled": True}
    entry = {"name": name, "arm": name, "simulated": None, "state": state, "text": name,
             "page": None, "here": False}  # fmt: skip
    arms.route("**/api/arms", lambda route: route.fulfill(json=[entry]))
    card = arms.get_by_role("listitem")
    expect(card.get_by_role("heading")).to_have_text("<img src=x onerror=alert(1)>\\u{202e}\\u{1b}")
    expect(card.locator("img")).to_have_count(0)
    expect(card).to_contain_text("unknown arm")
    arms.unroute("**/api/arms")
    arms.route("**/api/arms", lambda route: route.abort())
    expect(card).to_contain_text("state unknown", timeout=10_000)
    wait_for_state(arms, "gone")
