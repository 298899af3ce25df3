"""Fixtures of the tests of the page: one browser for all, one served arm for each module."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, sync_playwright

from dashboard.rig import Site, launched, open_page, require_browser, site


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """Start the browser."""
    require_browser()
    with sync_playwright() as playwright:
        started = launched(playwright)
        yield started
        started.close()


@pytest.fixture(scope="module")
def left() -> Iterator[Site]:
    """Serve an arm that the tests of a module share."""
    require_browser()
    with site() as made:
        yield made


@pytest.fixture
def context(browser: Browser) -> Iterator[BrowserContext]:
    """Return a browser's profile of its own."""
    with browser.new_context(viewport={"width": 1440, "height": 900}) as made:
        yield made


@pytest.fixture
def page(context: BrowserContext, left: Site) -> Iterator[Page]:
    """Return the page, signed in to operate; no error may appear in its console."""
    opened = open_page(context, left)
    yield opened
    assert opened.errors == []  # type: ignore[attr-defined]
