"""Faults on the page with their recovery, and the state of joints, loop and controllers."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect

from bioscara import Robot
from bioscara.robot.tasks.scope import Scope
from bioscara.web.gateway import Gateway, GatewaySettings
from dashboard.rig import Site, command, page_of, recover, wait_for_state
from programs import wait_until
from served import NAME, arm_served
from web.gateways import running_gateway

pytestmark = pytest.mark.browser

STEP = "#faults button.step"
MARKUP = "<img src=x onerror=\"document.title='hurt'\">"
GAP = """bioscara.connection.handlers.get("event")[0]({
    kind: "event", number: bioscara.arm.lastEvent, time: 0, wall: 0, what: "gap",
    text: "7 events are not kept any more", client: "", goal: null, fault: null, lease: null,
})"""

REFUSED = """() => bioscara.arm.events.some(({what, goal}) =>
    what === "goal_ended" && goal.failure?.text.includes("the bus is stuck"))"""
LATE_ANSWER = """() => {
    const ended = bioscara.ended.bind(bioscara);
    bioscara.ended = async (goal) => {
        const end = await ended(goal);
        await new Promise((resolve) => setTimeout(resolve, 900));
        return end;
    };
}"""

HURRY = """(button) => new MutationObserver(() => {
    if (window.hurried || button.textContent !== "Recover") return;
    window.hurried = true;
    button.click();
}).observe(button, { childList: true, characterData: true, subtree: true })"""


@pytest.fixture(scope="module")
def page(browser: Browser, left: Site) -> Iterator[Page]:
    """Return a page that operates the arm, which the tests share."""
    with page_of(browser, left) as opened:
        yield opened


def commanding(page: Page) -> None:
    """Let the page command the arm, unless it does."""
    if not page.evaluate("bioscara.arm.commands"):
        command(page)


def simulate(page: Page, fault: str, joint: str, value: float = 1.0) -> None:
    """Let the simulated arm fail, as the page's bench does."""
    commanding(page)
    page.evaluate(
        "(command) => bioscara.ask(command)",
        {"kind": "simulate_fault", "fault": fault, "joint": joint, "value": value},
    )


BENCH = """{"version": 1, "tool": "fingers", "load": null, "held": null, "scene": {"zones": [
    {"kind": "box", "zone": {"name": "reader", "lower": [0.2, -0.4, 0.0], "upper": [0.3, -0.3, 1]}}
]}}"""


def test_the_bench_of_the_last_owner_is_confirmed_on_the_page(
    browser: Browser, tmp_path: Path
) -> None:
    bench = tmp_path / "bench.json"
    bench.write_text(BENCH)
    with (
        arm_served(speed=1.0, bench=bench) as served,
        running_gateway(Gateway(GatewaySettings(NAME, port=0))) as gateway,
        Robot.connect(f"arm:{NAME}") as robot,
    ):
        looking: Any = robot
        own = Site(gateway.url, str(gateway.token_file), tmp_path, looking, os.getpid())
        with page_of(browser, own) as page:
            strip = page.locator("#unconfirmed .strip")
            expect(strip).to_contain_text("the scene (reader; no table): known from the last run")
            command(page)
            strip.get_by_role("button", name="Confirm").click()
            expect(strip).to_have_count(0)
        assert served.robot.runner.arm.workspace.unconfirmed == frozenset()


def take(page: Page, step: str) -> None:
    """Press the button of the next step, which has a name."""
    commanding(page)
    page.locator(f'{STEP}[aria-disabled="false"]', has_text=step).click()


def test_each_fault_leads_step_by_step_to_an_enabled_arm(page: Page, left: Site) -> None:
    robot = left.robot
    commanding(page)
    page.evaluate("async () => bioscara.ended((await bioscara.start({kind: 'enable'})).goal)")
    before = robot.state.positions
    simulate(page, "reset", "j3")
    strip = page.locator("#faults .strip")
    expect(strip).to_contain_text("JOINT_RESET j3")
    expect(strip).to_contain_text("check the joint's supply")
    wait_for_state(page, "fault")
    page.evaluate(LATE_ANSWER)
    page.locator(STEP).evaluate(HURRY)
    page.locator(f'{STEP}[aria-disabled="false"]', has_text="Acknowledge").dblclick()
    expect(strip).to_contain_text("Acknowledged is not cleared")
    wait_until(lambda: page.evaluate("window.hurried"), "a press as soon as the step is there")
    page.wait_for_timeout(200)
    assert robot.fault_list().state == "acknowledged"
    page.get_by_role("tab", name="Health").click()
    link = page.get_by_role("link", name="Flight record")
    evidence = page.request.get(link.evaluate("(link) => link.href"))
    assert evidence.body().startswith(b"\x89MCAP")
    take(page, "Recover")
    expect(strip).to_contain_text("Not homed: j3")
    assert robot.faults == ()
    assert not robot.is_enabled
    take(page, "Enable")
    expect(strip).to_contain_text("Step 4 of 4")
    expect(page.locator(STEP)).to_have_text("Home")
    assert robot.is_enabled
    strip.get_by_role("button", name="Close").click()
    expect(strip).to_have_count(0)
    after = robot.state.positions
    assert [after[joint] for joint in (0, 1, 3)] == pytest.approx(
        [before[joint] for joint in (0, 1, 3)], abs=1e-3
    )


def test_a_stuck_bus_is_told_with_its_remedy_and_recovery_is_refused_while_it_lasts(
    page: Page, left: Site
) -> None:
    robot = left.robot
    commanding(page)
    page.evaluate("async () => bioscara.ended((await bioscara.start({kind: 'enable'})).goal)")
    simulate(page, "bus_stuck", "")
    strip = page.locator("#faults .strip")
    expect(strip).to_contain_text("BUS_STUCK bioscara_arm")
    expect(strip).to_contain_text("free the line: switch the joints off and on")
    wait_for_state(page, "fault")
    take(page, "Acknowledge")
    expect(strip).to_contain_text("Acknowledged is not cleared")
    assert [fault.kind.name for fault in robot.faults] == ["BUS_STUCK"]
    page.get_by_role("tab", name="Health").click()
    facts = page.locator("#panel-health .fault")
    expect(facts).to_have_count(1)
    expect(facts).to_contain_text("first cause")
    expect(facts).to_contain_text("transactions in a row with 4 joints did not end")
    take(page, "Recover")
    wait_until(lambda: page.evaluate(REFUSED), "recovery is refused")
    simulate(page, "bus_stuck", "", 0.0)
    recover(robot)


def test_a_page_that_looks_sees_the_fault_and_takes_no_step(
    browser: Browser, page: Page, left: Site
) -> None:
    simulate(page, "overheat", "j1")
    try:
        with page_of(browser, left, Scope.VIEW, size=(390, 844)) as viewer:
            expect(viewer.locator("#faults .strip")).to_contain_text("OVERTEMPERATURE j1")
            wait_until(lambda: left.robot.fault_list().state == "latched", "the arm rests")
            expect(viewer.locator("#faults")).to_contain_text("Signed in to look")
            viewer.locator(STEP).click(force=True)
            assert left.robot.fault_list().state == "latched"
            viewer.locator("#faults button.link").click()
            expect(viewer.locator("#panel-health .fault dd").first).to_be_visible()
    finally:
        simulate(page, "overheat", "j1", 0)
    take(page, "Acknowledge")
    take(page, "Recover")
    wait_until(lambda: left.robot.faults == (), "the faults are cleared")


def test_the_joints_tell_what_the_owner_knows_of_them(page: Page, left: Site) -> None:
    page.get_by_role("tab", name="Health").click()
    table = page.locator("table.joint-reports")
    expect(table.locator("tr", has_text="Frames refused").locator("td").first).to_have_text("0")
    for joint, report in enumerate(left.robot.joint_reports().joints):
        cells = {
            row.locator("th").inner_text(): row.locator("td").nth(joint).inner_text()
            for row in table.locator("tbody tr").all()
        }
        assert report.boot_id is not None
        assert cells["Boot id"] == f"0x{report.boot_id:04x}"
        assert cells["Firmware"] == f"{report.firmware}, protocol {report.protocol}"
    hot = table.locator("tr", has_text="Temperature").locator("td")
    expect(hot).to_have_text(["no warning"] * 4)
    loop = page.locator("section", has_text="Control loop and bus")
    expect(loop.locator("tr", has_text="Late by").locator("td").last).to_have_text("60 ms")
    page.locator("summary", has_text="Controllers and hardware").click()
    row = page.locator("tr", has_text="arm.joint_state_broadcaster")
    expect(row.locator(".badge")).to_have_text("active")


def test_events_are_found_by_kind_and_words_and_a_gap_is_never_hidden(page: Page) -> None:
    page.get_by_role("tab", name="Health").click()
    page.evaluate("(text) => bioscara.ask({kind: 'report', text})", MARKUP)
    rows = page.locator("ol.events li")
    expect(rows.first).to_contain_text(MARKUP)
    assert page.locator("#panel-health img").count() == 0
    kind = page.get_by_label("Kind of event")
    kind.select_option("trouble")
    expect(rows.filter(has_text=MARKUP)).to_have_count(0)
    kind.select_option("people")
    page.get_by_label("Search in events").fill("ONERROR report")
    expect(rows).to_have_count(1)
    page.evaluate(GAP)
    expect(rows).to_have_count(2)
    expect(rows.first).to_contain_text("7 events are not kept any more")
    kind.select_option("goals")
    expect(rows).to_have_count(1)
