"""Bad days: after each failure within a hold the arm comes to rest and the page shows it."""

from __future__ import annotations

import json
import os
import signal
import socket
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from time import sleep
from typing import Any
from urllib.error import URLError
from urllib.request import urlopen

import pytest
from playwright.sync_api import Browser, BrowserContext, Page
from websockets.sync.client import ClientConnection, connect

from bioscara.api import messages as m
from bioscara.remote import RemoteRobot
from bioscara.robot.tasks.scope import Scope
from dashboard.rig import (
    ARGUMENTS,
    CHROMIUM,
    LIVE,
    Site,
    at_rest,
    command,
    open_page,
    page_of,
    recover,
    site,
    stays,
    wait_for_state,
)
from programs import environment, running, wait_for_line, wait_until
from served import HALF, NAME
from web.gateways import WebClientOfTest

pytestmark = pytest.mark.browser

RESTING = 1.2
"""Time in which the arm rests after the last beat of a jog [s]: its expiry, and the ramp."""
PROGRAM = str(Path(__file__).with_name("served_site.py"))


def button(robot: RemoteRobot) -> str:
    """Return the button of the first joint that leads back to where the arm stood."""
    sign = 1 if robot.state.positions[0] < HALF[0] else -1
    return f'.jog-button[data-axis="0"][data-sign="{sign}"]'


def hold(page: Page, robot: RemoteRobot) -> None:
    """Let the page command the arm and hold a button of the first joint by the mouse."""
    if page.locator("html").get_attribute("data-state") != "commanding":
        command(page)
    page.locator(button(robot)).hover()
    page.mouse.down()
    wait_until(lambda: abs(robot.state.velocities[0]) > 0.01, "j1 moves", 3.0)


def rests(robot: RemoteRobot, act: Callable[[], object]) -> None:
    """Require that an act brings the arm to rest in time, where it stays."""
    act()
    wait_until(lambda: at_rest(robot), "the jog ends", RESTING)
    stays(robot)


def kept(page: Page, *allowed: str) -> None:
    """Require that the page reported no error but those of the connection that was broken."""
    known = ("WebSocket", "Failed to load resource", *allowed)
    errors = page.errors  # type: ignore[attr-defined]
    assert [each for each in errors if not any(word in each for word in known)] == []


class Apart:
    """An owner, and a gateway that is a process of its own, at the same address each time.

    Attributes:
        gateway: Process of the gateway.
    """

    def __init__(self, made: Site) -> None:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port: int = free.getsockname()[1]
        self._made, self._stack = made, ExitStack()
        self.start()

    def start(self) -> None:
        """Start the gateway, and wait until it answers."""
        words = ["-m", "bioscara", "web", "--arm", NAME, "--port", str(self.port)]
        self.gateway = self._stack.enter_context(running(*words, env=environment()))
        wait_until(self._answers, "the gateway answers")

    def _answers(self) -> bool:
        try:
            with urlopen(f"http://127.0.0.1:{self.port}/healthz", timeout=2.0) as answer:
                return bool(answer.status == 200)
        except (URLError, TimeoutError):
            return False

    def site(self) -> Site:
        """Return the arm behind this gateway."""
        made = Site.__new__(Site)
        made.__dict__.update(vars(self._made), url=f"http://127.0.0.1:{self.port}/")
        return made

    def close(self) -> None:
        """End the gateway."""
        self._stack.close()


@pytest.fixture(scope="module")
def apart(left: Site) -> Iterator[Apart]:
    """Return a gateway that is a process of its own."""
    made = Apart(left)
    yield made
    made.close()


def test_a_network_that_goes_silent_ends_a_hold_and_control_is_taken_again(
    browser: Browser, apart: Apart, left: Site
) -> None:
    with page_of(browser, apart.site(), clean=False) as page:
        hold(page, left.robot)
        rests(left.robot, lambda: apart.gateway.send_signal(signal.SIGSTOP))
        wait_for_state(page, "gone")
        assert "unknown" in page.locator("#link").inner_text()
        assert "unknown" in page.locator("#lease").inner_text()
        assert page.locator("#lease-take").is_hidden()
        apart.gateway.send_signal(signal.SIGCONT)
        wait_for_state(page, *LIVE)
        # What had waited in the network moves nothing.
        stays(left.robot)
        kept(page)


def test_a_gateway_that_is_killed_ends_a_hold_and_its_successor_asks_to_sign_in(
    browser: Browser, apart: Apart, left: Site
) -> None:
    with page_of(browser, apart.site(), clean=False) as page:
        hold(page, left.robot)
        rests(left.robot, lambda: apart.gateway.send_signal(signal.SIGKILL))
        wait_for_state(page, "gone")
        apart.gateway.wait(5.0)
        apart.start()
        wait_for_state(page, "signed-out")
        stays(left.robot)
        kept(page)


def test_another_owner_under_the_page_is_commanded_only_after_asking_again(
    browser: Browser,
) -> None:
    with site() as made:
        gateway = Apart(made)
        with page_of(browser, gateway.site(), clean=False) as page:
            command(page)
            page.evaluate("""() => {
                const { names, positions } = bioscara.arm.sample;
                const rows = [positions, positions];
                bioscara.showPreview({
                    title: "a plan", plan: 1, time: 0, execute: async () => {},
                    trajectory: { joint_names: names, times: [0, 1], positions: rows },
                });
            }""")
            assert page.locator(".view-plan.dead").count() == 0
            os.kill(made.pid, signal.SIGKILL)
            wait_for_state(page, "gone")
            words = ["", "1.0", *map(str, HALF)]
            with running(PROGRAM, *words, env=environment()) as owner:
                wait_for_line(owner, "served")
                wait_for_state(page, "no-lease")
                assert page.evaluate("bioscara.arm.epoch") is None
                assert page.locator(".view-plan.dead").count() == 1
                with RemoteRobot(NAME) as robot:
                    page.locator(button(robot)).hover()
                    page.mouse.down()
                    page.wait_for_function(
                        "document.querySelector('.jog-status').textContent.includes('control')"
                    )
                    page.mouse.up()
                    stays(robot)
                    hold(page, robot)
                    rests(robot, page.mouse.up)
                owner.send_signal(signal.SIGTERM)
            kept(page)
        gateway.close()


def renderers(browser: Browser) -> set[int]:
    """Return the processes that draw pages."""
    found = browser.new_browser_cdp_session().send("SystemInfo.getProcessInfo")["processInfo"]
    return {each["id"] for each in found if each["type"] == "renderer"}


def test_a_renderer_that_stands_still_ends_a_hold_and_comes_back_with_fresh_values(
    browser: Browser, left: Site
) -> None:
    before = renderers(browser)
    with page_of(browser, left, clean=False) as page:
        hold(page, left.robot)
        own = renderers(browser) - before
        assert own

        def send(number: signal.Signals) -> None:
            for each in own:
                os.kill(each, number)

        try:
            rests(left.robot, lambda: send(signal.SIGSTOP))
            stays(left.robot, 2.0)
        finally:
            send(signal.SIGCONT)
        wait_for_state(page, *LIVE)
        page.wait_for_function("bioscara.arm.age < 200")
        # The lease of 2 s may have lapsed; the jog has ended either way.
        stays(left.robot)
        assert "running" not in page.locator(".jog-status").inner_text()


def test_a_fault_ends_a_hold_and_no_press_moves_the_arm_until_it_is_recovered(
    page: Page, left: Site
) -> None:
    hold(page, left.robot)
    heat = """(value) => bioscara.ask({
        kind: "simulate_fault", fault: "overheat", joint: "j2", value,
    })"""
    rests(left.robot, lambda: page.evaluate(heat, 1))
    wait_for_state(page, "fault")
    assert "No motion" in page.locator(".jog-status").inner_text()
    page.mouse.up()
    page.mouse.down()
    stays(left.robot)
    page.mouse.up()
    page.evaluate(heat, 0)
    recover(left.robot)
    wait_for_state(page, "no-lease")


def test_a_computer_that_slept_has_given_control_up(page: Page, left: Site) -> None:
    hold(page, left.robot)
    jump = "() => { const { now } = Date; Date.now = () => now.call(Date) + 3600e3; }"
    rests(left.robot, lambda: page.evaluate(jump))
    page.mouse.up()
    wait_for_state(page, "no-lease")
    assert not page.evaluate("bioscara.arm.commands")
    hold(page, left.robot)
    rests(left.robot, page.mouse.up)


def test_a_clock_that_is_an_hour_off_makes_no_value_old(
    context: BrowserContext, left: Site
) -> None:
    context.add_init_script("const { now } = Date; Date.now = () => now.call(Date) - 3600e3;")
    page = open_page(context, left)
    page.wait_for_timeout(400)
    assert page.evaluate("[bioscara.arm.age < 300, bioscara.arm.link]") == [True, "live"]
    hold(page, left.robot)
    rests(left.robot, page.mouse.up)


def test_a_session_that_is_signed_out_ends_a_hold(page: Page, left: Site) -> None:
    hold(page, left.robot)
    rests(left.robot, lambda: page.evaluate("fetch('/session', { method: 'DELETE' })"))
    wait_for_state(page, "signed-out")
    page.mouse.up()
    kept(page)
    page.errors.clear()  # type: ignore[attr-defined]


def test_a_second_tab_cannot_jog_and_its_end_and_a_takeover_are_told_apart(
    browser: Browser, page: Page, left: Site
) -> None:
    command(page)
    second = open_page(page.context, left)
    wait_for_state(second, "lease-elsewhere")
    second.locator(button(left.robot)).hover()
    second.mouse.down()
    stays(left.robot)
    second.mouse.up()
    second.close()
    page.bring_to_front()
    assert page.evaluate("bioscara.arm.commands")
    hold(page, left.robot)
    with page_of(browser, left, Scope.ADMIN, clean=False) as admin:
        rests(left.robot, lambda: admin.evaluate("bioscara.arm.acquire(true)"))
        wait_for_state(page, "lease-elsewhere")
        page.wait_for_selector("#lease-lost:not([hidden])")
        page.mouse.up()
        admin.evaluate("bioscara.arm.release()")
    wait_for_state(page, "no-lease")


@contextmanager
def raw(page: Page, left: Site) -> Iterator[WebClientOfTest]:
    """Open a WebSocket as the page does, with its cookie."""
    cookie = "; ".join(f"{each['name']}={each['value']}" for each in page.context.cookies())
    origin = left.url.rstrip("/")
    headers = {"Origin": origin, "Cookie": cookie}
    with connect(origin.replace("http", "ws") + "/ws", additional_headers=headers) as opened:
        client = WebClientOfTest(opened)
        client.greet("raw")
        yield client


def test_beats_of_another_session_or_a_former_lease_move_nothing(page: Page, left: Site) -> None:
    command(page)
    epoch = page.evaluate("bioscara.arm.epoch")
    jog = {"kind": "jog", "expiry": 0.25, "joints": [0.1, 0.0, 0.0, 0.0]}
    with raw(page, left) as client:
        for wrong in (None, epoch, epoch - 1, epoch + 1):
            assert client.request("start", wrong, task=jog).get("error") == "LeaseError"
        stays(left.robot)
        hold(page, left.robot)
        goal = page.evaluate("Math.max(...bioscara.arm.goals.keys())")
        velocity = [0.0, 0.0, 0.5, 0.0]
        for wrong in (epoch, epoch - 1):
            answer = client.request("set_jog_velocity", wrong, goal=goal, joints=velocity)
            assert answer.get("error") == "LeaseError"
        assert abs(left.robot.state.velocities[2]) < 0.05
        rests(left.robot, page.mouse.up)


def test_a_burst_of_samples_is_drawn_once(page: Page) -> None:
    told = page.evaluate("""async () => {
        let told = 0;
        const forget = bioscara.arm.on("sample", () => { told += 1; });
        const [take] = bioscara.connection.handlers.get("state");
        for (let i = 0; i < 100; i++) take({ ...bioscara.arm.sample });
        await new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
        forget();
        return told;
    }""")
    assert told <= 2


class DevTools:
    """A page of a Chromium that is not made visible by its driver.

    Args:
        address: Its socket.
    """

    def __init__(self, address: str) -> None:
        self._socket: ClientConnection = connect(address, max_size=None)
        self._number = 0

    def call(self, method: str, **parameters: object) -> Any:
        """Call a method; returns its result."""
        self._number += 1
        self._socket.send(json.dumps({"id": self._number, "method": method, "params": parameters}))
        while (answer := json.loads(self._socket.recv(10.0))).get("id") != self._number:
            pass
        # None of a page that is still loading.
        return answer.get("result", {})

    def evaluate(self, expression: str) -> Any:
        """Return the value of an expression of the page."""
        found = self.call(
            "Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True
        )
        return found.get("result", {}).get("value")

    def close(self) -> None:
        """End the connection."""
        self._socket.close()


@contextmanager
def two_tabs(url: str) -> Iterator[tuple[DevTools, Callable[[], object]]]:
    """Open a page in a browser with another tab; yields it, and what shows the other tab."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder, ExitStack() as stack:
        words = ["--headless=new", "--no-sandbox", "--remote-debugging-port=0", *ARGUMENTS]
        launch = "import os, sys; os.execv(sys.argv[1], sys.argv[1:])"
        stack.enter_context(
            running("-c", launch, CHROMIUM, *words, f"--user-data-dir={folder}", "about:blank")
        )
        port = Path(folder) / "DevToolsActivePort"
        wait_until(lambda: port.exists() and "\n" in port.read_text(), "the browser listens")
        number, path = port.read_text().split()
        main = DevTools(f"ws://127.0.0.1:{number}{path}")
        stack.callback(main.close)
        targets = main.call("Target.getTargets")["targetInfos"]
        other = next(each["targetId"] for each in targets if each["type"] == "page")
        own = main.call("Target.createTarget", url=url)["targetId"]
        page = DevTools(f"ws://127.0.0.1:{number}/devtools/page/{own}")
        stack.callback(page.close)
        yield page, lambda: main.call("Target.activateTarget", targetId=other)


@pytest.mark.parametrize("frozen", [False, True], ids=["hidden", "frozen"])
def test_a_tab_that_is_hidden_or_frozen_ends_a_hold(
    left: Site, browser: Browser, *, frozen: bool
) -> None:
    with two_tabs(left.url_for(Scope.OPERATE)) as (page, show_other):
        wait_until(
            lambda: page.evaluate("document.documentElement.dataset.state") == "no-lease", "live"
        )
        page.evaluate("bioscara.arm.acquire()")
        box = page.evaluate(f"""(() => {{
            const each = document.querySelector('{button(left.robot)}');
            each.scrollIntoView();
            const {{ x, y }} = each.getBoundingClientRect();
            return [x + 20, y + 20];
        }})()""")
        event = {"x": box[0], "y": box[1], "button": "left", "buttons": 1, "clickCount": 1}
        page.call("Input.dispatchMouseEvent", type="mousePressed", **event)
        wait_until(lambda: abs(left.robot.state.velocities[0]) > 0.01, "j1 moves", 3.0)

        def leave() -> None:
            show_other()
            if frozen:
                page.call("Page.setWebLifecycleState", state="frozen")

        rests(left.robot, leave)
        if frozen:
            page.call("Page.setWebLifecycleState", state="active")
        else:
            assert page.evaluate("document.visibilityState") == "hidden"
        stays(left.robot)
    wait_until(lambda: not holder(left.robot), "it is given back, or lapses")


def holder(robot: RemoteRobot) -> str | None:
    """Return the client that commands the arm."""
    return robot._ask(m.GetLease(), m.LeaseState).lease.client


def test_a_hidden_tab_keeps_control_although_its_timers_stand_still(left: Site) -> None:
    """A browser lets them run once a minute after some time, but not while DevTools look."""
    with two_tabs(left.url_for(Scope.OPERATE)) as (page, show_other):
        wait_until(
            lambda: page.evaluate("document.documentElement.dataset.state") == "no-lease", "live"
        )
        page.evaluate("bioscara.arm.acquire()")
        show_other()
        wait_until(lambda: page.evaluate("document.hidden"), "it is hidden")
        page.evaluate("for (let timer = 1; timer < 10000; timer += 1) clearInterval(timer)")
        # Three times to live.
        for _ in range(12):
            sleep(0.5)
            assert holder(left.robot)
        page.evaluate("bioscara.arm.release()")
