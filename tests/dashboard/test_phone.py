"""The page on a phone: touch, the row of one axis, and the view only on request."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser, CDPSession, Page, Route, expect

from dashboard.accessible import SMALL, STOP_SEEN, WIDE, violations
from dashboard.jogging import ends, pressed, touch, towards
from dashboard.rig import (
    LIVE,
    Site,
    at_rest,
    command,
    open_page,
    page_of,
    positions,
    stays,
    wait_for_state,
)
from programs import wait_until

pytestmark = pytest.mark.browser

SIZES = {"390": (390, 844), "320": (320, 640)}
AXES = {"joints": ["J1", "J2", "J3", "J4"], "tool": ["X", "Y", "Z", "Yaw"]}


@pytest.fixture(scope="module", params=SIZES)
def page(browser: Browser, left: Site, request: pytest.FixtureRequest) -> Iterator[Page]:
    """Return the page on a phone of each size, which commands the arm, with the jog open."""
    size = SIZES[request.param]
    with page_of(browser, left, size=size, has_touch=True, is_mobile=True) as opened:
        command(opened)
        opened.get_by_role("tab", name="Jog").tap()
        yield opened


def rows(page: Page) -> list[str]:
    """Return the names of the rows that are seen."""
    return page.locator(".jog-row:visible .jog-name").all_inner_texts()


def finger(page: Page, left: Site) -> tuple[CDPSession, dict[str, float]]:
    """Return what sends touches, and a point on the large button that leads j1 back."""
    box = page.locator(f".jog-row.chosen [data-sign='{towards(left)}']").bounding_box()
    assert box is not None
    assert min(box["width"], box["height"]) >= 64
    return page.context.new_cdp_session(page), {"x": box["x"] + 20, "y": box["y"] + 20, "id": 1}


def option(page: Page, name: str) -> Any:
    return page.get_by_role("radio", name=name, exact=True)


def test_one_axis_is_shown_with_the_values_of_all_and_another_one_by_a_touch(
    page: Page, left: Site
) -> None:
    assert page.evaluate("matchMedia('(pointer: coarse)').matches")
    axes = page.get_by_role("radiogroup", name="Axis")
    for mode, names in AXES.items():
        page.locator(f"[data-value={mode}]").tap()
        assert [len(rows(page)), axes.get_by_role("radio").count()] == [1, 4]
        for name in names:
            option(page, name).tap()
            assert rows(page) == [name]
            expect(option(page, name)).to_be_checked()
    page.locator("[data-value=joints]").tap()
    degrees = left.robot.state.positions[0] * 57.29578
    expect(option(page, "J1")).to_have_accessible_description(f"{degrees:.2f}°")


def test_the_axis_is_chosen_by_keys_which_do_not_move_the_arm(page: Page, left: Site) -> None:
    option(page, "J1").tap()
    before = positions(left.robot)
    option(page, "J1").focus()
    for name in ("J2", "J3", "J4", "J1"):
        page.keyboard.press("ArrowRight")
        expect(option(page, name)).to_be_focused()
        assert rows(page) == [name]
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.className") == "jog-pad"
    page.keyboard.press("Tab")
    expect(page.locator(".jog-row.chosen [data-sign='-1']")).to_be_focused()
    assert positions(left.robot) == pytest.approx(before, abs=2e-4)


def test_the_key_of_another_axis_shows_its_row_and_moves_it(page: Page, left: Site) -> None:
    option(page, "J1").tap()
    page.locator(".jog-row.chosen [data-sign='1']").focus()
    before = positions(left.robot)
    page.keyboard.down("e")
    wait_until(lambda: abs(positions(left.robot)[3] - before[3]) > 2e-3, "j4 moves")
    page.keyboard.up("e")
    assert rows(page) == ["J4"]
    wait_until(lambda: at_rest(left.robot), "the arm rests")
    stays(left.robot)


def test_a_finger_moves_the_axis_that_is_shown_until_another_one_is_chosen(
    page: Page, left: Site
) -> None:
    option(page, "J1").tap()
    other = option(page, "J3").bounding_box()
    assert other is not None
    devtools, first = finger(page, left)
    second = {"x": other["x"] + 10, "y": other["y"] + 10, "id": 2}
    pressed(
        left,
        lambda: touch(devtools, "touchStart", first),
        lambda: touch(devtools, "touchEnd"),
    )
    ends(left, lambda: touch(devtools, "touchStart", first, second))
    touch(devtools, "touchEnd")
    devtools.detach()
    stays(left.robot)


def test_the_tabs_needed_beside_the_arm_are_first_and_stop_is_64_pixels_high(page: Page) -> None:
    page.evaluate("scrollTo(0, 0)")
    tabs = page.locator("#tabs [role=tab]:visible")
    assert tabs.all_inner_texts()[:4] == ["View", "Jog", "Run", "Health"]
    boxes = [tabs.nth(index).bounding_box() for index in range(4)]
    assert len({box and box["y"] for box in boxes}) == 1
    assert all(box and box["height"] >= 44 for box in boxes)
    stop = page.locator("#stop-button").bounding_box()
    assert stop is not None
    assert stop["height"] >= 64
    size = page.viewport_size
    assert size is not None
    jog = page.locator(".jog-row.chosen").bounding_box()
    assert jog is not None
    # Without scrolling.
    assert jog["y"] + jog["height"] < stop["y"]


def test_axe_finds_nothing_and_all_of_it_fits(page: Page) -> None:
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        for mode in ("tool", "joints"):
            page.locator(f"[data-value={mode}]").tap()
            assert violations(page) == []
            assert page.evaluate(SMALL) == []
            assert page.evaluate(WIDE) <= 0
            assert page.evaluate(STOP_SEEN)


def test_the_view_is_loaded_only_when_it_is_asked_for(browser: Browser, left: Site) -> None:
    context = browser.new_context(
        viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True
    )
    asked: list[str] = []
    context.on("request", lambda request: asked.append(request.url))
    page = open_page(context, left)
    page.get_by_role("tab", name="Jog").tap()
    page.wait_for_function("() => bioscara.arm.workspace !== null")
    heavy = ("/vendor/three.js", "/js/view/solid/solid_view.js")
    assert not any(url.endswith(heavy) for url in asked)
    page.get_by_role("tab", name="View").tap()
    page.wait_for_selector(".view-canvas[tabindex='0']")
    assert any(url.endswith(heavy[0]) for url in asked)
    assert page.errors == []  # type: ignore[attr-defined]
    context.close()


def test_a_preview_opens_the_view_with_its_buttons_in_sight_before_and_after_it_is_loaded(
    page: Page, left: Site
) -> None:
    held: list[Route] = []

    def hold_back(route: Route) -> None:
        held.append(route)

    page.route("**/three.js", hold_back)
    page.reload()
    wait_for_state(page, *LIVE)
    command(page)
    page.get_by_role("tab", name="Run").tap()
    go = page.get_by_role("region", name="Go to a pose")
    go.get_by_role("button", name="Fill in").tap()
    go.locator("#go-z").fill(f"{1000 * left.robot.pose.z + 8:.1f}")
    go.get_by_role("button", name="Preview", exact=True).tap()
    expect(page.get_by_role("tab", name="View")).to_have_attribute("aria-selected", "true")
    execute = page.locator(".view-plan").get_by_role("button", name="Execute")
    expect(execute).to_be_in_viewport()

    def above_stop() -> bool:
        box, stop = execute.bounding_box(), page.locator("#stop-button").bounding_box()
        return box is not None and stop is not None and box["y"] + box["height"] < stop["y"]

    assert above_stop()
    wait_until(lambda: page.evaluate("1") == len(held), "the drawing is asked for")
    held[0].continue_()
    page.wait_for_selector(".view-canvas[tabindex='0']")
    assert above_stop()
    page.get_by_role("button", name="Discard").tap()
    page.get_by_role("tab", name="Jog").tap()


SPY = """() => {
    const { request } = WakeLock.prototype;
    window.locks = [];
    WakeLock.prototype.request = async function (kind) {
        const lock = await request.call(this, kind);
        locks.push(lock);
        return lock;
    };
}"""
LOCKED = "() => locks.filter((lock) => !lock.released).length"


def test_the_screen_stays_on_during_a_jog_which_ends_where_it_goes_off(
    page: Page, left: Site
) -> None:
    page.evaluate(SPY)
    option(page, "J1").tap()
    devtools, point = finger(page, left)
    try:
        for lost in (False, True):
            pressed(
                left,
                lambda: touch(devtools, "touchStart", point),
                lambda: touch(devtools, "touchEnd"),
            )
            wait_until(lambda: page.evaluate(LOCKED) == 1, "the screen is kept on")
            if lost:
                # As the browser does where the battery is low or the page is covered.
                ends(left, lambda: page.evaluate("locks.at(-1).release()"))
                assert "the screen went off" in page.locator(".jog-status").inner_text()
                touch(devtools, "touchEnd")
            else:
                ends(left, lambda: touch(devtools, "touchEnd"))
            wait_until(lambda: page.evaluate(LOCKED) == 0, "the screen may go off again")
    finally:
        devtools.detach()
    stays(left.robot)
