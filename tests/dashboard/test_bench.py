"""The simulation bench: faults begun and ended on the page, and the reactions of the software."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from bioscara.robot.tasks.scope import Scope
from dashboard.rig import Site, at_rest, command, page_of, recover
from programs import wait_until

pytestmark = pytest.mark.browser

REAL = """() => {
    bioscara.arm.description.simulated = false;
    for (const listener of bioscara.arm.listeners.get("description")) listener();
}"""


@pytest.fixture(scope="module")
def page(browser: Browser, left: Site) -> Iterator[Page]:
    """Return a page that operates the arm, which the tests share."""
    with page_of(browser, left) as opened:
        opened.get_by_role("tab", name="Simulation").click()
        yield opened


def card(page: Page, name: str) -> Locator:
    """Return the part of the panel about a fault."""
    return page.get_by_role("region", name=name, exact=True)


def recovered(page: Page, site: Site) -> None:
    """Take all steps out of the faults, as a client does."""
    page.get_by_role("button", name="All off").click()
    expect(page.locator("#panel-bench")).to_contain_text("Nothing is simulated to fail")
    wait_until(lambda: at_rest(site.robot), "the arm rests")
    recover(site.robot)


def test_an_obstacle_stops_the_arm_and_the_page_tells_how(page: Page, left: Site) -> None:
    expect(page.locator("#panel-bench")).to_contain_text("This arm is simulated.")
    left.robot.enable()
    left.robot.release_lease()
    command(page)
    obstacle = card(page, "Obstacle")
    expect(obstacle).to_contain_text("Expected: A joint that runs into it stalls")
    here = left.robot.state.positions[0]
    obstacle.locator("input").fill(str(57.2958 * (here + 0.1)))
    obstacle.get_by_role("button", name="Begin").click()
    expect(page.locator("#panel-bench")).to_contain_text("On now: Obstacle (j1).")
    page.get_by_role("button", name="Move it there and back").click()
    expect(obstacle.locator("li", has_text="STALL: j1").first).to_be_visible(timeout=10000)
    assert left.robot.faults[0].kind.name == "STALL"
    assert left.robot.state.positions[0] == pytest.approx(here + 0.1, abs=0.02)
    recovered(page, left)
    before = left.robot.state.positions[0]
    command(page)
    page.get_by_role("button", name="Move it there and back").click()
    wait_until(lambda: left.robot.state.positions[0] > before + 0.15, "the obstacle is away")
    wait_until(lambda: not left.robot.is_moving, "the motion has ended")


def test_a_fault_begins_and_ends_while_another_client_commands(page: Page, left: Site) -> None:
    left.robot.acquire_lease(force=True)
    frozen = card(page, "Frozen encoder")
    frozen.get_by_role("button", name="Begin").click()
    wait_until(lambda: len(left.robot.simulation.faults) == 1, "the fault has begun")
    expect(page.get_by_role("button", name="Move it there and back")).to_be_disabled()
    page.get_by_role("button", name="All off").click()
    wait_until(lambda: left.robot.simulation.faults == (), "the fault has ended")
    left.robot.release_lease()


def test_the_code_of_a_control_does_the_same(page: Page, left: Site) -> None:
    held = card(page, "Bus stuck low")
    code = held.locator("button.copy-python").evaluate("(button) => button.python()")
    assert code == 'robot.simulate_fault("bus_stuck", "", 1.0)'
    left.robot.acquire_lease(force=True)
    exec(code, {"robot": left.robot})
    wait_until(lambda: "BUS_STUCK" in {fault.kind.name for fault in left.robot.faults}, "the fault")
    left.robot.release_lease()
    command(page)
    recovered(page, left)


def test_the_time_of_the_arm_passes_as_fast_as_is_chosen(page: Page, left: Site) -> None:
    if not page.evaluate("bioscara.arm.commands"):
        command(page)
    speed = page.get_by_label("Speed of time").last
    speed.select_option("10")
    expect(page.locator("#panel-bench")).to_contain_text("Nothing is simulated to fail")

    def speed_of_time() -> float:
        begin = page.evaluate("[bioscara.arm.sample.time, performance.now()]")
        page.wait_for_timeout(300)
        end = page.evaluate("[bioscara.arm.sample.time, performance.now()]")
        return 1e3 * float(end[0] - begin[0]) / float(end[1] - begin[1])

    # As fast as a late computer can.
    wait_until(lambda: speed_of_time() > 2.0, "time passes faster")
    speed.select_option("1")
    wait_until(lambda: page.evaluate("bioscara.arm.link") == "live", "the values are fresh")


def test_who_looks_only_can_let_nothing_fail(browser: Browser, left: Site) -> None:
    with page_of(browser, left, Scope.VIEW, size=(390, 844)) as page:
        page.get_by_role("tab", name="Simulation").click()
        expect(page.locator("#panel-bench")).to_contain_text("Signed in to look")
        expect(card(page, "Push").get_by_role("button", name="Begin")).to_be_disabled()
        expect(page.get_by_role("button", name="All off")).to_be_disabled()
        # Not for a real arm.
        page.evaluate(REAL)
        expect(page.get_by_role("tab", name="Simulation")).to_be_hidden()
