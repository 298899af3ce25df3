"""The page signs in, connects, and knows how old its values are."""

from __future__ import annotations

import pytest
from playwright.sync_api import BrowserContext, Page

from bioscara.robot.tasks.scope import Scope
from dashboard.rig import Site, open_page, wait_for_state
from programs import wait_until

pytestmark = pytest.mark.browser


@pytest.mark.path
def test_the_page_shows_the_arm_and_removes_the_token_from_its_address(page: Page) -> None:
    assert "token" not in page.url
    assert page.title() == "left \u2013 SIMULATED \u2013 Bioscara"
    assert page.locator("html").get_attribute("data-simulated") == "true"
    sample = page.evaluate("bioscara.arm.sample")
    assert sample["names"] == ["j1", "j2", "j3", "j4"]


def test_a_page_without_a_token_says_where_to_get_one(context: BrowserContext, left: Site) -> None:
    page = context.new_page()
    page.goto(left.url)
    wait_for_state(page, "signed-out")
    assert "open the address" in page.locator("#messages").inner_text().lower()


def test_a_page_that_stands_still_gets_no_queue_of_old_samples(page: Page) -> None:
    page.evaluate(
        "() => { const end = performance.now() + 1500; while (performance.now() < end); }"
    )
    wait_until(lambda: page.evaluate("bioscara.arm.age") < 200, "the values are fresh", 1.0)


def test_two_pages_have_two_sessions(context: BrowserContext, left: Site) -> None:
    first, second = open_page(context, left), open_page(context, left, Scope.VIEW)
    sessions = [each.evaluate("bioscara.connection.session") for each in (first, second)]
    assert sessions[0] != sessions[1]
