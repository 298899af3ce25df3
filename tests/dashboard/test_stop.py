"""STOP stops the arm in each state of page and connection, and shows what became of it."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

import pytest
from playwright.sync_api import Browser, Page

from bioscara.errors import LeaseError
from bioscara.robot.tasks.scope import Scope
from dashboard.rig import (
    DIALOG,
    Site,
    at_rest,
    command,
    page_of,
    recover,
    stays,
    swing,
    wait_for_state,
)
from programs import wait_until

pytestmark = pytest.mark.browser

SIZES = [(1440, 900), (1024, 768), (390, 844)]
STOPPED = """(before) => bioscara.arm.events.some(
    ({ number, what, client }) =>
        number > before && what === "stop" && client.startsWith("dashboard"))"""
TABS = ("Run", "Health")


@pytest.fixture(scope="module")
def page(browser: Browser, left: Site) -> Iterator[Page]:
    """Return a page that only looks, which the tests share."""
    with page_of(browser, left, Scope.VIEW, clean=False) as opened:
        yield opened


def press(page: Page) -> None:
    """Press the mouse button on STOP, wherever that is; fails where something covers it."""
    box = page.locator("#stop-button").bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()


def escape(page: Page) -> None:
    """Press Escape, wherever the focus is."""
    page.keyboard.press("Escape")


def shown(page: Page, state: str, limit: float = 3000) -> str:
    """Wait until a state of STOP is shown; return the words."""
    page.wait_for_selector(f'#stop[data-state="{state}"]', timeout=limit)
    return page.locator(".stop-state").inner_text()


def stops(page: Page, left: Site, way: Callable[[Page], None]) -> None:
    """Require that a press brings a moving arm to rest, and that it stays there."""
    swing(left.robot)
    way(page)
    wait_until(lambda: at_rest(left.robot), "the arm rests", 1.0)
    shown(page, "resting")
    page.mouse.up()
    stays(left.robot)


def commands_elsewhere(page: Page, left: Site) -> bool:
    """Return whether the page sees that the robot commands the arm; take the lease if it does not.

    A page repeats STOP until it is confirmed: a copy that comes late ends this lease, too.
    """
    with suppress(LeaseError):
        left.robot.acquire_lease(force=True)
    return page.locator("html").get_attribute("data-state") == "lease-elsewhere"


@contextmanager
def dialog(page: Page) -> Iterator[None]:
    """Keep a dialog open; Escape closes it."""
    page.evaluate(DIALOG)
    yield
    page.evaluate("window.dispatchEvent(new KeyboardEvent('keydown', {key: 'Escape'}))")
    page.wait_for_selector(".dialog", state="detached")


@contextmanager
def tab(page: Page, name: str) -> Iterator[None]:
    """Show a part of the page."""
    page.get_by_role("tab", name=name).click()
    yield
    page.get_by_role("tab", name="Run").click()


def arrives(page: Page, left: Site, way: Callable[[Page], None]) -> None:
    """Require that one press reaches the owner."""
    # Presses of one client within two seconds are one event, unless a pause came in between.
    left.robot.pause()
    left.robot.resume()
    before = page.evaluate("bioscara.arm.lastEvent")
    way(page)
    page.wait_for_function(STOPPED, arg=before, timeout=3000)
    page.mouse.up()


@pytest.mark.parametrize("size", SIZES, ids=lambda size: str(size[0]))
def test_stop_s1_stop_s2_one_press_or_escape_stops_in_each_view_and_dialog(
    page: Page, left: Site, size: tuple[int, int]
) -> None:
    page.set_viewport_size({"width": size[0], "height": size[1]})
    for way in (press, escape):
        wait_until(lambda: commands_elsewhere(page, left), "the page sees another client command")
        arrives(page, left, way)
        wait_for_state(page, "no-lease")
        arrives(page, left, way)
        for name in TABS:
            with tab(page, name):
                arrives(page, left, way)
        with dialog(page):
            arrives(page, left, way)
    with dialog(page):
        stops(page, left, press)


@contextmanager
def no_socket(page: Page) -> Iterator[None]:
    """Break the connection for good, until the page is loaded again."""
    page.evaluate(
        "() => { bioscara.connection.connect = () => {}; bioscara.connection.socket.close(); }"
    )
    wait_for_state(page, "gone")
    yield
    page.reload()
    wait_for_state(page, "no-lease", "lease-elsewhere")


def test_stop_s1_without_a_socket_it_goes_by_a_request_of_its_own(page: Page, left: Site) -> None:
    page.set_viewport_size({"width": 1440, "height": 900})
    with no_socket(page):
        swing(left.robot)
        press(page)
        wait_until(lambda: at_rest(left.robot), "the arm rests", 1.0)
        assert "Received" in shown(page, "decelerating")
        page.mouse.up()
        stays(left.robot)


def test_stop_s1_it_stops_in_a_fault_too(page: Page, left: Site) -> None:
    robot = left.robot
    robot.acquire_lease(force=True)
    try:
        robot.simulate_fault("overheat", "j2")
        wait_for_state(page, "fault")
        for way in (press, escape):
            arrives(page, left, way)
    finally:
        robot.acquire_lease(force=True)
        robot.simulate_fault("overheat", "j2", 0.0)
        recover(robot)
    wait_for_state(page, "no-lease")


def test_stop_s2_it_acts_on_the_press_and_before_a_dialog_closes(page: Page, left: Site) -> None:
    page.evaluate(DIALOG)
    page.evaluate("""() => {
        window.order = [];
        const { send } = WebSocket.prototype;
        WebSocket.prototype.send = function (data) {
            if (data.includes('"stop"')) order.push("stop");
            return send.call(this, data);
        };
        new MutationObserver(() => {
            if (!document.querySelector(".dialog")) order.push("closed");
        }).observe(document.body, { childList: true });
    }""")
    escape(page)
    page.wait_for_function("() => order.length >= 2")
    assert page.evaluate("order") == ["stop", "closed"]
    # Also where a control keeps Escape to itself.
    page.evaluate("""() => {
        order.length = 0;
        const field = document.getElementById("go-x");
        field.addEventListener("keydown", (event) => event.stopImmediatePropagation());
        field.focus();
    }""")
    escape(page)
    page.wait_for_function("() => order.length >= 1")
    page.evaluate("order.length = 0")
    press(page)
    assert page.evaluate("order") == ["stop"]
    page.mouse.up()
    page.wait_for_timeout(50)
    assert page.evaluate("order") == ["stop"]


def test_stop_s3_it_is_black_or_white_and_the_largest_control_and_says_what_it_is_not(
    page: Page,
) -> None:
    button = page.get_by_role("button", name="STOP", exact=True)
    assert button.is_enabled()
    described = page.locator(f"#{button.get_attribute('aria-describedby')}").inner_text()
    assert "not an emergency stop" in described
    for scheme, colour in (("light", "rgb(0, 0, 0)"), ("dark", "rgb(255, 255, 255)")):
        page.emulate_media(color_scheme=scheme)  # type: ignore[arg-type]
        assert button.evaluate("(b) => getComputedStyle(b).backgroundColor") == colour
    page.emulate_media(color_scheme="light")
    areas = page.evaluate("""() => Array.from(document.querySelectorAll("button"))
        .map((b) => [b.id, b.offsetWidth * b.offsetHeight]).sort((a, b) => b[1] - a[1])""")
    assert areas[0][0] == "stop-button"


@pytest.mark.path
def test_stop_s4_it_shows_that_it_was_sent_received_and_that_the_arm_rests(
    page: Page, left: Site
) -> None:
    page.evaluate("""() => {
        window.words = [];
        const status = document.querySelector(".stop-state");
        const note = () => words.push(status.textContent);
        new MutationObserver(note).observe(status, { childList: true });
    }""")
    stops(page, left, press)
    # Empty while the words of a stop before are taken away.
    words = [word for word in page.evaluate("words") if word]
    assert words[0] == "Sent."
    assert "ms. Decelerating." in words[1]
    assert "At rest." in words[-1]


def test_stop_s4_it_says_that_it_was_not_confirmed_and_goes_on_until_it_is(
    page: Page, left: Site
) -> None:
    sent: list[str] = []
    page.on(
        "request", lambda request: sent.append(request.method) if "stop" in request.url else None
    )
    os.kill(left.pid, signal.SIGSTOP)
    try:
        press(page)
        assert shown(page, "unconfirmed", 1000) == "NOT CONFIRMED, use the emergency stop"
        page.mouse.up()
        page.wait_for_timeout(700)
        assert len(sent) >= 3
    finally:
        os.kill(left.pid, signal.SIGCONT)
    assert "Received after" in shown(page, "resting", 10e3)
    count = len(sent)
    page.wait_for_timeout(450)
    assert len(sent) == count


def test_stop_s5_the_way_on_is_one_button_and_nothing_begins_again(
    page: Page, left: Site, browser: Browser
) -> None:
    with page_of(browser, left, clean=False) as operator:
        left.robot.release_lease()
        wait_for_state(operator, "no-lease")
        command(operator)
        stops(operator, left, escape)
        # The stop came from the page that had lost its lease: it says how to go on.
        box = operator.locator(".stop-box")
        assert "Nothing continues by itself. Take control to move it again." in box.inner_text()
        assert operator.get_by_role("button", name="Take control").count() == 1
        command(operator)
        stays(left.robot)
        box.get_by_role("button", name="Close").click()
        assert not box.is_visible()


def test_stop_s6_each_state_has_a_word_a_mark_and_its_colour(page: Page, left: Site) -> None:
    left.robot.acquire_lease(force=True)
    wait_for_state(page, "lease-elsewhere")
    state = page.locator(".badge.state")
    assert state.inner_text() == "◐\nanother client commands"
    colours = page.evaluate("""async () => {
        const { STATES } = await import("/js/header.js");
        const { text } = await import("/js/texts.js");
        return Object.entries(STATES).map(([name, [mark, colour]]) =>
            [name, mark, colour, text(`state.${name}`), text(`allowed.${name}`)]);
    }""")
    assert len(colours) == 10
    assert all(mark and word and allowed for _, mark, _, word, allowed in colours)
    by_name = {name: colour for name, _, colour, _, _ in colours}
    assert by_name["fault"] == by_name["gone"] == "danger"
    assert by_name["stale"] == "warn"
    assert by_name["commanding"] == "good"
    assert by_name["recovering"] == "action"
