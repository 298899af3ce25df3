"""A jog lasts as long as a press: however a press ends or gets lost, the arm comes to rest."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser, Page

from bioscara.api import messages as m
from dashboard.jogging import EXPIRY, J1, ends, pressed, touch, towards
from dashboard.rig import (
    DIALOG,
    LIVE,
    Site,
    at_rest,
    command,
    page_of,
    positions,
    stays,
    wait_for_state,
)
from programs import wait_until
from served import HALF

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def shared(browser: Browser, left: Site) -> Iterator[Page]:
    """Return a page that the tests share."""
    with page_of(browser, left, clean=False) as opened:
        yield opened


@pytest.fixture
def page(shared: Page, left: Site) -> Iterator[Page]:
    """Return the page, which commands an arm at rest, with the pad as it was built."""
    take(shared, left)
    yield shared
    shared.mouse.up()
    shared.mouse.up(button="right")


def take(page: Page, left: Site) -> None:
    """Let the page command the arm."""
    wait_until(lambda: at_rest(left.robot), "the arm rests", 5.0)
    if page.locator("html").get_attribute("data-state") != "commanding":
        left.robot.acquire_lease(force=True)
        left.robot.release_lease()
        wait_for_state(page, "no-lease")
        command(page)


def hold(page: Page, left: Site) -> None:
    """Hold the button of the first joint by the mouse."""
    page.locator(f'{J1}[data-sign="{towards(left)}"]').hover()
    pressed(left, page.mouse.down, page.mouse.up)


def hold_key(page: Page, left: Site) -> str:
    """Hold the key of the first joint; return it."""
    page.locator(".jog-pad").focus()
    key = "ArrowLeft" if towards(left) > 0 else "ArrowRight"
    pressed(left, lambda: page.keyboard.down(key), lambda: page.keyboard.up(key))
    return key


def hold_finger(page: Page, left: Site) -> Any:
    """Hold the button of the first joint by a finger; return what sends touches."""
    box = page.locator(f'{J1}[data-sign="{towards(left)}"]').bounding_box()
    assert box is not None
    devtools = page.context.new_cdp_session(page)
    point = {"x": box["x"] + 20, "y": box["y"] + 20, "id": 1}
    pressed(
        left,
        lambda: touch(devtools, "touchStart", point),
        lambda: touch(devtools, "touchEnd"),
    )
    return devtools, point


def words(page: Page) -> str:
    return page.locator(".jog-status").inner_text()


def dispatch(page: Page, target: str, event: str) -> None:
    page.evaluate(f"() => {target}.dispatchEvent(new Event('{event}'))")


BUSY = "() => { const end = performance.now() + 1500; while (performance.now() < end); }"

REMOVE = """() => {
    const row = document.querySelector(".jog-row");
    Object.assign(window, { row, after: row.nextSibling });
    row.remove();
}"""
PUT_BACK = "() => { if (window.row && !row.isConnected) after.before(row); }"
ENDINGS: dict[str, Callable[[Page, Site], object]] = {
    "release": lambda page, _: page.mouse.up(),
    "leave": lambda page, _: page.mouse.move(300, 300),
    "chord": lambda page, _: page.mouse.down(button="right"),
    "removed button": lambda page, _: page.evaluate(REMOVE),
    "tab": lambda page, _: page.evaluate("document.getElementById('tab-health').click()"),
    "dialog": lambda page, _: page.evaluate(DIALOG),
    "blur": lambda page, _: dispatch(page, "window", "blur"),
    "hidden": lambda page, _: dispatch(page, "document", "visibilitychange"),
    "freeze": lambda page, _: dispatch(page, "document", "freeze"),
    "mode": lambda page, _: page.evaluate("document.querySelector('[data-value=tool]').click()"),
    "focus": lambda page, _: page.evaluate("document.getElementById('go-x').focus()"),
    "takeover": lambda _, left: left.robot.acquire_lease(force=True),
    "pause": lambda _, left: left.robot.pause(),
    "stop": lambda _, left: left.robot.stop(),
    "socket": lambda page, _: page.evaluate("bioscara.connection.socket.close()"),
    "busy page": lambda page, _: page.evaluate(BUSY),
}
EXPIRE = ("socket", "busy page")
"""Endings of which the owner knows by the beats that do not come."""


@pytest.mark.parametrize("ending", ENDINGS)
def test_jog_r3_jog_r4_each_ending_of_a_press_brings_the_arm_to_rest(
    page: Page, left: Site, ending: str
) -> None:
    hold(page, left)
    assert page.locator("html").get_attribute("data-pressed") == "true"
    try:
        ends(
            left,
            lambda: ENDINGS[ending](page, left),
            expires=ending in EXPIRE,
            after=1.5 if ending == "busy page" else 0.0,
        )
        page.wait_for_selector("html:not([data-pressed])", state="attached")
        assert ending == "release" or words(page).startswith("No motion")
    finally:
        page.mouse.up()
        page.mouse.up(button="right")
        page.keyboard.press("Escape")
        page.evaluate(PUT_BACK)
        page.evaluate("document.querySelector('[data-value=joints]').click()")
        page.get_by_role("tab", name="Run").click()
        if ending == "pause":
            left.robot.acquire_lease(force=True)
            left.robot.resume()
        wait_for_state(page, *LIVE)
    # The release has gone by: only a new press moves the arm.
    stays(left.robot)


@pytest.mark.path
def test_jog_r4_the_left_button_that_is_released_before_the_right_one_ends_it(
    page: Page, left: Site
) -> None:
    hold(page, left)
    page.mouse.down(button="right")
    ends(left, page.mouse.up)
    page.mouse.up(button="right")
    stays(left.robot)


@pytest.mark.parametrize("kind", ["touchEnd", "touchCancel", "second finger", "drift"])
def test_jog_r4_each_end_of_a_touch_brings_the_arm_to_rest(
    page: Page, left: Site, kind: str
) -> None:
    devtools, point = hold_finger(page, left)
    second = {"x": 300.0, "y": 300.0, "id": 2.0}
    acts: dict[str, Callable[[], None]] = {
        "second finger": lambda: touch(devtools, "touchStart", point, second),
        "drift": lambda: touch(devtools, "touchMove", {**point, "y": point["y"] + 150}),
    }
    ends(left, acts.get(kind, lambda: touch(devtools, kind)))
    if kind in acts:
        touch(devtools, "touchEnd")
    stays(left.robot)
    devtools.detach()


def test_jog_r5_keys_move_the_arm_only_while_the_pad_has_the_focus(page: Page, left: Site) -> None:
    page.locator("#go-kind").focus()
    before = positions(left.robot)
    page.keyboard.down("ArrowLeft")
    page.wait_for_timeout(150)
    page.keyboard.up("ArrowLeft")
    assert at_rest(left.robot)
    assert positions(left.robot) == pytest.approx(before, abs=2e-4)
    key = hold_key(page, left)
    page.keyboard.down(key)
    page.keyboard.down(key)
    assert page.locator("html").get_attribute("data-pressed") == "true"
    ends(left, lambda: page.keyboard.up(key))


@pytest.mark.parametrize("other", ["Shift", "Control", "ArrowRight", "Tab", "x"])
def test_jog_r5_another_key_and_a_modifier_end_it(page: Page, left: Site, other: str) -> None:
    key = hold_key(page, left)
    opposite = {"ArrowLeft": "ArrowRight", "ArrowRight": "ArrowLeft"}[key]
    wanted = opposite if other == "ArrowRight" else other
    ends(left, lambda: page.keyboard.down(wanted))
    page.keyboard.up(key)
    # Both were held: the one that is left moves nothing.
    stays(left.robot)
    page.keyboard.up(wanted)


def test_jog_r5_a_key_with_a_modifier_is_refused(page: Page, left: Site) -> None:
    page.locator(".jog-pad").focus()
    before = positions(left.robot)
    page.keyboard.press("Control+ArrowLeft")
    assert "Shift, Ctrl, Alt or Meta" in words(page)
    assert positions(left.robot) == pytest.approx(before, abs=2e-4)


def test_jog_r1_beats_keep_a_jog_alive_and_steps_are_finite_goals_one_at_a_time(
    page: Page, left: Site
) -> None:
    sent = spied(page)

    def commanded() -> list[dict[str, Any]]:
        return [each["command"] for each in sent() if each.get("kind") == "request"]

    def beats() -> list[dict[str, Any]]:
        return [each for each in commanded() if each["kind"] == "set_jog_velocity"]

    hold(page, left)
    wait_until(lambda: len(beats()) > 5, "beats keep the jog alive")
    page.mouse.up()
    commands = commanded()
    (task,) = [each["task"] for each in commands if each["kind"] == "start"]
    assert task["kind"] == "jog"
    assert task["expiry"] == EXPIRY
    assert task["joints"][0] != 0
    assert [each["kind"] for each in commands][-1] == "end_jog" or "end_jog" in str(commands)
    wait_until(lambda: at_rest(left.robot), "the arm rests")
    before = left.robot.state.positions[0]
    page.get_by_role("button", name="1", exact=True).click()
    sign = towards(left)
    button = page.locator(f'{J1}[data-sign="{sign}"]')
    button.click()
    page.wait_for_selector('html[data-moving="true"]', state="attached")
    button.click()
    assert "the former step has not ended" in words(page)
    wait_until(lambda: at_rest(left.robot), "the step ends")
    page.get_by_role("button", name="Hold", exact=True).click()
    assert left.robot.state.positions[0] - before == pytest.approx(sign * 0.01745, abs=1e-3)


def test_jog_r2_jog_r6_a_jog_that_has_expired_is_dead_and_late_beats_are_refused(
    page: Page, left: Site
) -> None:
    sent = spied(page)
    hold(page, left)
    # The main thread beats: a page that hangs sends none.
    page.evaluate(BUSY)
    assert at_rest(left.robot)
    goal = next(
        each["command"]["goal"] for each in sent() if each["command"]["kind"] == "set_jog_velocity"
    )
    refused = page.evaluate("""(goal) => bioscara.request({
        kind: "set_jog_velocity", goal, joints: [0.05, 0, 0, 0],
    }).then(() => "", (error) => error.message)""", goal)  # fmt: skip
    assert refused
    stays(left.robot)


FASTEST = """async (j1) => {
    const poses = [];
    bioscara.connection.on("state", ({ time, pose }) => poses.push([time, ...pose]));
    const joints = [j1, 0, 0, 0];
    const { goal } = await bioscara.start({ kind: "jog", expiry: 0.25, joints });
    for (let i = 0; i < 16; i++) {
        await new Promise((resolve) => setTimeout(resolve, 50));
        await bioscara.request({ kind: "set_jog_velocity", goal, joints });
    }
    await bioscara.request({ kind: "end_jog", goal });
    await bioscara.ended(goal);
    return Math.max(...poses.slice(4).map((now, index) => {
        const was = poses[index];
        return Math.hypot(now[1] - was[1], now[2] - was[2], now[3] - was[3]) / (now[0] - was[0]);
    }));
}"""


def test_jog_r8_the_tool_keeps_to_the_speed_that_is_shown_and_to_250_mm_s(
    page: Page, left: Site
) -> None:
    slider = page.locator("#jog-speed")
    assert (slider.input_value(), slider.get_attribute("max")) == ("25", "250")
    hold(page, left)
    page.wait_for_function(
        "() => /now \\d+ mm/.test(document.querySelector('.jog-speed').textContent)"
    )
    page.mouse.up()
    wait_until(lambda: at_rest(left.robot), "the arm rests")
    # One rad/s is 0.7 m/s at the tool.
    fastest = page.evaluate(FASTEST, float(towards(left)))
    assert 0.1 < fastest < 0.26
    assert "no enabling device" in page.locator("#jog").inner_text()


SAYS = "(text) => document.querySelector('.jog-status').textContent === text"


def hold_until(page: Page, sign: int, text: str) -> None:
    """Hold a button of the first axis until the pad shows a text."""
    page.locator(f'{J1}[data-sign="{sign}"]').hover()
    page.mouse.down()
    page.wait_for_function(SAYS, arg=text)


def brought_to(left: Site, joints: tuple[float, ...]) -> None:
    """Let the client move the arm and give its lease back."""
    left.robot.acquire_lease(force=True)
    left.robot.move_joints(joints)
    left.robot.release_lease()


def test_a_hold_that_is_slowed_or_moves_nothing_says_why_also_at_its_end(
    page: Page, left: Site
) -> None:
    brought_to(left, (HALF[0], HALF[1], 0.0, HALF[3]))
    try:
        wait_for_state(page, "no-lease")
        command(page)
        page.locator("[data-value=tool]").click()
        held = "x, y held: the elbow is straight; move inwards"
        hold_until(page, 1, held)
        assert page.locator(".jog-status.warn").count() == 1
        page.mouse.up()
        wait_until(lambda: at_rest(left.robot), "the arm rests")
        assert words(page) == held
        goal = left.robot._ask(m.ListGoals(), m.GoalList).goals[-1]
        assert str(goal.limitation) == held
        # Inwards the elbow bends, slowly at first.
        hold_until(page, -1, "x, y slowed: the elbow is nearly straight")
        page.wait_for_function(SAYS, arg="Moves while you hold.")
        page.mouse.up()
        assert words(page) == ""
    finally:
        page.mouse.up()
        wait_until(lambda: at_rest(left.robot), "the arm rests")
        page.locator("[data-value=joints]").click()
        brought_to(left, HALF)


def test_jog_r9_after_a_reload_or_a_navigation_nothing_moves_and_control_is_taken_again(
    page: Page, left: Site
) -> None:
    hold(page, left)
    ends(left, lambda: page.reload(wait_until="commit"), expires=None)
    wait_for_state(page, "no-lease", "lease-elsewhere")
    page.mouse.up()
    page.locator(f'{J1}[data-sign="1"]').hover()
    page.mouse.down()
    page.wait_for_function(
        "() => document.querySelector('.jog-status').textContent.includes('No motion')"
    )
    stays(left.robot)
    page.mouse.up()
    wait_for_state(page, "no-lease")
    command(page)
    hold(page, left)
    url = page.url
    ends(left, lambda: page.goto("about:blank"), expires=None)
    page.mouse.up()
    page.goto(url)
    wait_for_state(page, "no-lease", "lease-elsewhere")


PAD = """() => {
    const buttons = Array(12).fill({ pressed: false });
    window.pad = { connected: true, index: 0, timestamp: 1, axes: [0, 0, 0, 0], buttons };
    navigator.getGamepads = () => [pad];
    window.beat = setInterval(() => { if (!pad.frozen) pad.timestamp += 1; }, 10);
    window.dispatchEvent(new Event("gamepadconnected"));
}"""


def set_pad(page: Page, axis: float, deadman: bool) -> None:
    page.evaluate(
        """([axis, pressed]) => {
            pad.axes = [0, axis, 0, 0];
            pad.buttons = pad.buttons.map((b, i) => ({ pressed: pressed && i === 5 }));
        }""",
        [axis, deadman],
    )


def test_jog_r10_a_gamepad_needs_its_deadman_button_a_centred_stick_and_news(
    page: Page, left: Site
) -> None:
    page.evaluate(PAD)
    try:
        stick = -float(towards(left))
        set_pad(page, stick, True)
        page.wait_for_timeout(200)
        # Held since before it was connected.
        stays(left.robot)
        set_pad(page, 0.0, False)
        page.wait_for_timeout(120)
        set_pad(page, stick, False)
        page.wait_for_timeout(120)
        assert at_rest(left.robot)
        pressed(left, lambda: set_pad(page, stick, True), lambda: set_pad(page, stick, False))
        ends(left, lambda: set_pad(page, stick, False))
        pressed(left, lambda: set_pad(page, stick, True), lambda: set_pad(page, stick, False))
        ends(left, lambda: page.evaluate("pad.frozen = true"), after=0.2)
        assert "sends nothing" in page.locator("#jog").inner_text()
        page.evaluate("pad.frozen = false")
        page.wait_for_timeout(120)
        stays(left.robot)
    finally:
        page.evaluate("() => { clearInterval(beat); navigator.getGamepads = () => []; }")
        dispatch(page, "window", "gamepaddisconnected")


@pytest.mark.parametrize("case", ["no lease", "disabled", "paused"])
def test_a_press_that_does_nothing_says_why(page: Page, left: Site, case: str) -> None:
    expected = {"no lease": "take control first", "disabled": "disabled", "paused": "paused"}
    try:
        if case == "no lease":
            page.get_by_role("button", name="Give back").click()
        elif case == "disabled":
            page.evaluate("bioscara.start({ kind: 'disable' })")
            page.wait_for_function("() => !bioscara.arm.sample.enabled")
        else:
            left.robot.pause()
            page.wait_for_function("() => bioscara.arm.sample.paused")
        page.locator(f'{J1}[data-sign="1"]').hover()
        page.mouse.down()
        page.wait_for_function("() => document.querySelector('.jog-status').textContent !== ''")
        assert expected[case] in words(page)
        page.mouse.up()
        stays(left.robot)
    finally:
        wait_until(lambda: at_rest(left.robot), "the arm rests")
        left.robot.acquire_lease(force=True)
        left.robot.resume()
        left.robot.enable()
        left.robot.release_lease()


def spied(page: Page) -> Callable[[], list[dict[str, Any]]]:
    """Return a function that returns the messages of the page from now on."""
    page.evaluate("""() => {
        window.sent = [];
        window.send_ ??= WebSocket.prototype.send;
        WebSocket.prototype.send = function (data) {
            sent.push(data);
            return send_.call(this, data);
        };
    }""")
    return lambda: [
        each for each in map(json.loads, page.evaluate("sent")) if each["kind"] == "request"
    ]
