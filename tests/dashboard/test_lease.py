"""The page shows the holder of the lease, takes and gives back control, and reports its loss."""

from __future__ import annotations

from time import monotonic, sleep

import pytest
from playwright.sync_api import Browser, BrowserContext, Page

from bioscara.api import messages as m
from bioscara.robot.tasks.scope import Scope
from dashboard.rig import (
    Site,
    at_rest,
    command,
    open_page,
    page_of,
    stays,
    swing,
    wait_for_state,
)
from programs import wait_until
from served import HALF

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


def begin_motion(page: Page, left: Site, share: float = 0.1) -> None:
    """Let a page that has the lease move the arm for some seconds, at a share of its speed."""
    command(page)
    goal = HALF[0] + (0.3 if left.robot.state.positions[0] < HALF[0] else -0.3)
    task = {"kind": "move_joints", "positions": [goal, *HALF[1:]], "velocity_scaling": share}
    page.evaluate("task => bioscara.start(task)", task)
    wait_until(lambda: abs(left.robot.state.velocities[0]) > 0.5 * share, "it moves")


def holder(left: Site) -> str | None:
    """Return the client that commands the arm."""
    return left.robot._ask(m.GetLease(), m.LeaseState).lease.client


def occupy(page: Page, time: float) -> float:
    """Let the page's own thread do nothing else for a time [s]; returns when that begins."""
    page.evaluate(
        """time => {
            setTimeout(() => {
                const end = performance.now() + 1000 * time;
                while (performance.now() < end);
            });
        }""",
        time,
    )
    return monotonic()


def test_a_busy_page_keeps_the_lease_and_its_motion(page: Page, left: Site) -> None:
    begin_motion(page, left, 0.02)
    begin = occupy(page, 3.5)
    while monotonic() < begin + 3.4:
        assert holder(left), f"it has lapsed after {monotonic() - begin:.2f} s"
        assert not at_rest(left.robot)
        sleep(0.05)
    page.evaluate("0")
    assert monotonic() > begin + 3.4
    assert page.evaluate("bioscara.arm.commands")
    assert not page.locator("#lease-lost").is_visible()
    assert not at_rest(left.robot)
    page.evaluate("bioscara.arm.release()")
    wait_until(lambda: at_rest(left.robot), "its motion has ended")
    stays(left.robot)


def test_a_page_that_hangs_loses_the_lease_with_its_motion(page: Page, left: Site) -> None:
    begin_motion(page, left, 0.02)
    begin = occupy(page, 9.0)
    wait_until(lambda: not holder(left), "the lease has lapsed", 9.0)
    # Renewed for 5 s at most, and for 2 s from then on.
    assert 5.0 < monotonic() - begin < 8.0
    wait_until(lambda: at_rest(left.robot), "its motion has ended", 1.0)
    stays(left.robot)
    page.wait_for_selector("#lease-lost:not([hidden])")
    assert "has lapsed" in page.locator("#lease-lost").inner_text()
    assert not page.evaluate("bioscara.arm.commands")


LEAVE = {
    "close": lambda page, _: page.close(run_before_unload=True),
    "reload": lambda page, _: page.evaluate("setTimeout(() => location.reload())"),
    "away": lambda page, site: page.evaluate(
        f"setTimeout(() => location.assign('{site.url}arms.html'))"
    ),
}


@pytest.mark.parametrize("how", LEAVE)
def test_a_page_that_is_left_gives_control_back_at_once_after_a_word(
    browser: Browser, left: Site, how: str
) -> None:
    with page_of(browser, left, clean=False) as page:
        begin_motion(page, left)
        with page.expect_event("dialog") as asked:
            LEAVE[how](page, left)
        assert asked.value.type == "beforeunload"
        assert abs(left.robot.state.velocities[0]) > 0.01
        asked.value.accept()
        begin = monotonic()
        wait_until(lambda: abs(left.robot.state.velocities[0]) < 1e-3, "the arm rests", 2.0)
        # Decelerating from a tenth of its speed takes a few hundredths.
        assert monotonic() - begin < 0.5
        wait_until(lambda: at_rest(left.robot), "the motion has ended")
        stays(left.robot)
        assert holder(left) is None


def test_a_page_that_moves_nothing_is_left_without_a_word(page: Page, left: Site) -> None:
    command(page)
    page.on("dialog", lambda dialog: pytest.fail(dialog.type))
    page.reload()
    wait_for_state(page, "no-lease")


def test_a_page_that_comes_back_works_again(page: Page, left: Site) -> None:
    command(page)
    page.evaluate("""() => {
        const tell = (name) =>
            window.dispatchEvent(new PageTransitionEvent(name, { persisted: true }));
        tell("pagehide");
        setTimeout(() => tell("pageshow"), 300);
    }""")
    wait_for_state(page, "no-lease")
    wait_until(lambda: bool(page.evaluate("bioscara.arm.fresh")), "it has samples again")
    assert not page.evaluate("bioscara.arm.commands")
    command(page)
