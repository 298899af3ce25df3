"""The page of ``bioscara view`` in the browser, without an owner."""

from __future__ import annotations

import math
import re
import subprocess
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from bioscara.cli.parser import parse
from bioscara.cli.shared_arguments import START
from bioscara.cli.view_source import onlooker_of, viewed_from
from bioscara.model import load_parameters
from bioscara.planning import Trajectory, write_csv
from bioscara.planning.collision.scene import Scene
from bioscara.robot import kinematics_of
from bioscara.web.viewer import ViewServer
from dashboard.accessible import violations
from programs import wait_until
from web.gateways import running_gateway

pytestmark = pytest.mark.browser

PARAMETERS = load_parameters()
ARM = kinematics_of(PARAMETERS)
NAMES = tuple(joint.name for joint in PARAMETERS.joints)
SWING = Trajectory(NAMES, [0.0, 1.0, 3.0], [START, (-0.2, 0.1, 0.9, -0.6), (-1.2, 0.1, 1.4, -0.6)])


@contextmanager
def viewed(browser: Browser, *words: str, size: tuple[int, int] = (1440, 900)) -> Iterator[Page]:
    """Open the page that ``bioscara view`` opens; no error may appear in its console."""
    options = parse(["view", *words])
    live = options.source is not None and options.source.startswith("sim:")
    onlooker = onlooker_of(options.source) if live and options.source else None
    server = ViewServer(0, viewed_from(options, PARAMETERS), onlooker.look if onlooker else None)
    context = browser.new_context(viewport={"width": size[0], "height": size[1]})
    with ExitStack() as ended:
        ended.enter_context(closing(context))
        if onlooker:
            ended.callback(onlooker.close)
        ended.enter_context(running_gateway(server))
        page = context.new_page()
        errors: list[str] = []
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on("console", lambda line: errors.append(line.text) if line.type == "error" else None)
        page.goto(server.url)
        page.wait_for_selector('html[data-state="live"]', state="attached")
        wait_until(lambda: page.evaluate("Boolean(bioscara.view)"), "the arm is drawn")
        yield page
        assert errors == []
        page.close()


def pose(page: Page) -> list[float]:
    """Return the shown pose of the tool [m, rad], from the numbers that a person reads."""
    shown = page.locator(".view-pose").inner_text()
    numbers = [float(number) for number in re.findall(r"-?\d+\.\d+", shown)]
    return [1e-3 * number for number in numbers[:3]] + [math.radians(yaw) for yaw in numbers[3:]]


def is_at(page: Page, time: float) -> bool:
    """Return whether the page shows the pose that the file has at a time."""
    expected = ARM.forward(SWING.sample(time).positions)
    return pose(page) == pytest.approx([*expected], abs=2e-3)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    write_csv(tmp_path / "swing.csv", SWING)
    return tmp_path / "swing.csv"


def test_a_trajectory_is_played_at_the_poses_of_its_file(browser: Browser, file: Path) -> None:
    with viewed(browser, str(file)) as page:
        expect(page.get_by_role("heading", name=str(file))).to_be_visible()
        expect(page.get_by_role("button", name="Execute")).to_be_hidden()
        expect(page.get_by_role("button", name="Discard")).to_be_hidden()
        wait_until(lambda: is_at(page, 0.0), "it stands at the begin")
        time = page.get_by_role("slider", name="Time in the plan")
        for there in (1.0, 2.4):
            time.fill(str(there))
            wait_until(lambda at=there: is_at(page, at), "it is there")  # type: ignore[misc]
        page.get_by_role("combobox", name="Speed of playing").select_option("10")
        page.get_by_role("button", name="Play").click()
        wait_until(lambda: is_at(page, 3.0), "it is at the end")
        expect(page.locator(".plan-clock")).to_have_text("3.00 of 3.00 s")
        expect(page.get_by_role("button", name="Play")).to_be_visible()
        page.get_by_role("combobox", name="Speed of playing").select_option("0.1")
        page.get_by_role("button", name="Play").click()
        wait_until(lambda: 0.0 < page.evaluate("bioscara.preview.time") < 1.0, "from the begin")
        page.get_by_role("button", name="Pause").click()
        still = page.evaluate("bioscara.preview.time")
        assert page.evaluate("bioscara.preview.time") == still
        expect(page.locator("#plots .plot")).to_have_count(2)


def test_the_joints_are_moved_by_sliders_also_with_the_keys(browser: Browser) -> None:
    with viewed(browser) as page:
        slider = page.get_by_role("slider", name="j2 [mm]")
        slider.fill("100.4")
        shown = pytest.approx([*ARM.forward((START[0], 0.1004, *START[2:]))], abs=2e-3)
        wait_until(lambda: pose(page) == shown, "the arm has followed")
        expect(page.locator(".viewed-joint", has_text="j2").locator(".number")).to_have_text(
            re.compile(r"100\.40? mm|100\.4\d mm")
        )
        slider.focus()
        slider.press("End")
        row = page.locator(".viewed-joint", has_text="j2")
        expect(row).to_contain_text("from the limit")
        expect(page.locator(".view-clearance")).to_contain_text("mm")
        gripper = page.get_by_role("slider", name="gripper [mm]")
        gripper.fill("60")
        wait_until(
            lambda: page.evaluate("bioscara.arm.sample.width") == pytest.approx(0.06), "the jaws"
        )


def test_the_clearance_is_that_of_the_shown_positions(browser: Browser, file: Path) -> None:
    def distance(time: float) -> float:
        return float(Scene().clearance(ARM, [SWING.sample(time).positions])[0])

    with viewed(browser, str(file)) as page:
        for time in (0.0, 3.0):
            page.get_by_role("slider", name="Time in the plan").fill(str(time))
            wanted = f"{1e3 * distance(time):.1f} mm"
            expect(page.locator(".view-clearance")).to_contain_text(wanted)
        expect(page.locator(".plan-notes")).to_contain_text("least clearance")


def test_a_simulated_arm_is_shown_and_waited_for(
    browser: Browser, start: Callable[..., subprocess.Popen[str]], tmp_path: Path
) -> None:
    path = str(tmp_path / "arm.sock")
    arm = start("-m", "bioscara", "simulate", "--socket", path)
    wait_until(Path(path).exists, "it listens")
    with viewed(browser, f"sim:{path}") as page:
        with closing(onlooker_of(f"sim:{path}")) as onlooker:
            _, joints = onlooker.look()
        shown = pytest.approx([*ARM.forward(joints)], abs=2e-3)
        wait_until(lambda: pose(page) == shown, "it is where the arm is")
        arm.kill()
        expect(page.locator("#messages")).to_contain_text("This page waits for it.")
        expect(page.locator(".view-banner")).to_contain_text("NOT LIVE")
        arm.wait()
        Path(path).unlink(missing_ok=True)
        start("-m", "bioscara", "simulate", "--socket", path)
        expect(page.locator("#messages")).to_be_empty()
        expect(page.locator(".view-banner")).to_be_hidden()


@pytest.mark.parametrize("size", [(1440, 900), (390, 844)], ids=["desktop", "phone"])
def test_everyone_can_read_and_use_it(browser: Browser, file: Path, size: tuple[int, int]) -> None:
    for words in ([str(file)], []):
        with viewed(browser, *words, size=size) as page:
            for scheme in ("light", "dark"):
                page.emulate_media(color_scheme=scheme)
                assert violations(page) == []
            wide = page.evaluate("document.documentElement.scrollWidth")
            assert wide <= size[0]


def test_without_the_token_it_says_where_it_is(browser: Browser, file: Path) -> None:
    server = ViewServer(0, viewed_from(parse(["view", str(file)]), PARAMETERS))
    with running_gateway(server):
        page = browser.new_context().new_page()
        page.goto(server.url.partition("#")[0])
        expect(page.locator("#messages")).to_contain_text("Open the address that “bioscara web”")
        page.context.close()
