"""Make pictures of the dashboard: each tab and each state, at three sizes, light and dark.

Used by :mod:`tools.pictures`; needs the extra ``web``, Playwright and Chromium.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Literal, cast

from PIL import Image
from playwright.sync_api import Browser, BrowserContext, Page, sync_playwright

from bioscara import Joints, NamedPose, Robot, Scene, read_scene
from bioscara.api.runtime import VARIABLE
from bioscara.errors import BioscaraError
from bioscara.remote import RemoteRobot
from bioscara.robot.tasks.scope import Scope
from bioscara.web.access.tokens import default_path, load_tokens

ARM, PORT = "left", 18099
SIZES = {"desktop": (1440, 900), "tablet": (1024, 768), "phone": (390, 844)}
SCHEMES: tuple[Literal["light", "dark"], ...] = ("light", "dark")
START = (0.3, 0.2, 0.8, -0.5)
"""Where the arm stands [rad, m, rad, rad]."""
PATIENCE = 30.0
"""Longest time that the owner takes to start, or the arm to home [s]."""
SETTLED = 700
"""Time in which a page is drawn without a graphics processor [ms]."""
AGED = """(age) => Object.defineProperty(bioscara.arm, "arrival", {
    get: () => performance.now() - age, set() {}, configurable: true,
})"""
"""Makes a page's values as old as given [ms]."""
SWING = b"time,j1,j2,j3,j4\n0,0.3,0.2,0.8,-0.5\n1,0.5,0.2,0.8,-0.5\n2.5,0.3,0.2,0.8,-0.5\n"
TO_AND_FRO = b"""schema: 1
title: to and fro
tool: fingers
steps:
- {kind: move_named, name: gate, velocity_scaling: 0.9}
- {kind: wait, seconds: 0.2}
- {kind: move_named, name: scale, velocity_scaling: 0.9}
...
"""
REACHED, COLLIDING = ("542", "300"), ("150", "450")
"""x and y of a target that the tool can reach, and of one in a zone [mm]."""
DOCUMENTED = {
    "run-commanding-desktop-light": "dashboard",
    "jog-commanding-phone-dark": "dashboard-phone",
    "plots-commanding-desktop-dark": "dashboard-plots",
    "health-fault-desktop-light": "dashboard-fault",
    "bench-commanding-tablet-light": "dashboard-bench",
}
"""Pictures of the documentation: name among all, name in it."""


def make_page_pictures(folder: Path, images: Path) -> None:
    """Write all pictures into a folder, and those of the documentation into ``images``.

    Args:
        folder: Gets a PNG file for each tab, state, size and colour scheme.
        images: Gets those of :data:`DOCUMENTED`, with fewer colours.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with served() as robot, sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), chromium_sandbox=False
        )
        for size in SIZES:
            for scheme in SCHEMES:
                photograph(browser, robot, folder, size, scheme)
        browser.close()
    for name, target in DOCUMENTED.items():
        with Image.open(folder / f"{name}.png") as picture:
            picture.convert("RGB").quantize(128).save(images / f"{target}.png", optimize=True)


@contextmanager
def served() -> Iterator[RemoteRobot]:
    """Serve a homed simulated arm and its page; yields a client of it."""
    before = os.environ.get(VARIABLE)
    with tempfile.TemporaryDirectory(prefix="b") as folder:
        os.environ[VARIABLE] = folder
        words = ["serve", "--name", ARM, "--with", f"web --port {PORT}"]
        words += ["--evidence", folder, "--table", f"{folder}/poses.yaml"]
        owner = subprocess.Popen(
            [sys.executable, "-m", "bioscara", *words],
            stdout=subprocess.DEVNULL,
            env={**os.environ, "STATE_DIRECTORY": folder},
        )
        try:
            with _connected() as robot:
                robot.home()
                robot.move_joints(START)
                robot.table = robot.table.with_pose(NamedPose("gate", Joints(*START)))
                robot.table = robot.table.with_pose(
                    NamedPose("scale", Joints(0.1, 0.15, 1.0, -0.4))
                )
                robot.scene = scene_of_example()
                robot.release_lease()
                yield robot
        finally:
            owner.send_signal(signal.SIGTERM)
            owner.wait(PATIENCE)
            if before is None:
                del os.environ[VARIABLE]
            else:
                os.environ[VARIABLE] = before


def scene_of_example() -> Scene:
    """Return the scene of the examples."""
    return read_scene(Path(__file__).parents[1] / "examples/scene.yaml")


def _connected() -> RemoteRobot:
    end = time.monotonic() + PATIENCE
    while True:
        try:
            robot = cast("RemoteRobot", Robot.connect(f"arm:{ARM}"))
            if default_path(ARM).exists():
                return robot
            robot.close()
        except BioscaraError:
            if time.monotonic() > end:
                raise
        time.sleep(0.3)


def photograph(browser: Browser, robot: RemoteRobot, folder: Path, size: str, scheme: str) -> None:
    """Make the pictures of all tabs and states at one size, in one colour scheme."""
    width, height = SIZES[size]
    context = browser.new_context(
        viewport={"width": width, "height": height},
        color_scheme=scheme,  # type: ignore[arg-type]
        has_touch=size != "desktop",
    )
    camera = Camera(context, folder, f"{size}-{scheme}")
    page = camera.page
    wait_for(page, "no-lease")
    camera.take("run", "no-lease")
    robot.acquire_lease()
    wait_for(page, "lease-elsewhere")
    camera.take("run", "lease-elsewhere")
    robot.release_lease()
    wait_for(page, "no-lease")
    page.get_by_role("button", name="Take control").click()
    wait_for(page, "commanding")
    for tab in camera.tabs():
        camera.take(tab, "commanding")
    _photograph_work(camera)
    _photograph_fault(camera, robot)
    for state, age in (("stale", 500), ("gone", 5000)):
        page.evaluate(AGED, age)
        wait_for(page, state)
        camera.take("run", state)
    page.goto(f"{_address()}arms.html")
    page.wait_for_selector("#arms li")
    camera.take("", "arms")
    page.context.clear_cookies()
    page.goto("about:blank")
    page.goto(_address())
    wait_for(page, "signed-out")
    camera.take("", "signed-out")
    context.close()


def _photograph_work(camera: Camera) -> None:
    """Make pictures of a target, a file, a sequence, a frame, a draft, a load and STOP."""
    page = camera.page
    camera.open("watch" if "watch" in camera.tabs() else "run")
    page.get_by_role("button", name="Target", exact=True).click()
    for (x, y), shown in ((REACHED, "view-plan"), (COLLIDING, "target-refusal")):
        for field, value in zip(page.locator(".target-row input").all(), (x, y), strict=False):
            field.fill(value)
            field.press("Enter")
        page.locator(".view-target").get_by_role("button", name="Plan", exact=True).click()
        page.locator(f".{shown}:visible").scroll_into_view_if_needed()
        camera.keep(shown)
    page.get_by_role("button", name="Target", exact=True).click()
    camera.open("files")
    _give(page, ".yaml,.yml,.csv", "swing.csv", SWING)
    page.get_by_role("button", name="Execute", exact=True).first.scroll_into_view_if_needed()
    camera.keep("files-trajectory")
    camera.open("teach")
    _give(page, ".yaml,.yml", "to_and_fro.yaml", TO_AND_FRO)
    page.locator(".step-choose").nth(2).click()
    page.get_by_role("button", name="Dry run").click()
    camera.keep("teach-sequence")
    for name in ("Take the origin here", "Take a point on x here"):
        page.get_by_role("button", name=name).click()
    camera.keep("teach-frame")
    camera.open("settings")
    page.get_by_role("textbox", name="joints.j2.upper [m]").fill("0.3")
    page.get_by_role("button", name="Check changes").click()
    camera.keep("settings-draft")
    page.get_by_role("button", name="Discard changes").click()
    camera.open("run")
    summary = page.locator("summary", has_text="Grasp a load")
    summary.click()
    camera.keep("run-load")
    summary.click()
    page.get_by_role("button", name="STOP", exact=True).press("Enter")
    camera.take("run", "stopped")
    page.locator(".stop-box button").click()


def _give(page: Page, kinds: str, name: str, content: bytes) -> None:
    """Choose a file in the field that accepts these kinds."""
    field = page.locator(f"input[type=file][accept='{kinds}']")
    field.set_input_files({"name": name, "mimeType": "text/plain", "buffer": content})


def _photograph_fault(camera: Camera, robot: RemoteRobot) -> None:
    robot.acquire_lease(force=True)
    robot.simulate_fault("overheat", "j2")
    wait_for(camera.page, "fault")
    camera.take("run", "fault")
    camera.take("health", "fault")
    robot.simulate_fault("overheat", "j2", 0.0)
    for _ in range(20):
        # The evidence of the fault is kept first.
        with suppress(BioscaraError):
            robot.acknowledge()
            robot.recover()
            robot.enable()
            break
        time.sleep(0.2)
    robot.release_lease()


class Camera:
    """Makes pictures of one page.

    Args:
        context: Profile of the browser.
        folder: Gets the pictures.
        end: End of their names.

    Attributes:
        page: The page, signed in as administrator.
    """

    def __init__(self, context: BrowserContext, folder: Path, end: str) -> None:
        self._folder, self._end = folder, end
        self.page: Page = context.new_page()
        self.page.goto(f"{_address()}#token={load_tokens(default_path(ARM)).of(Scope.ADMIN)}")

    def tabs(self) -> list[str]:
        """Return the tabs that are there at this size."""
        every = self.page.locator("#tabs [role=tab]:visible").all()
        return [str(tab.get_attribute("id")).removeprefix("tab-") for tab in every]

    def take(self, tab: str, state: str) -> None:
        """Make a picture of the window.

        Args:
            tab: The tab to open; empty to open none.
            state: State of the page, for the name of the picture.
        """
        if tab:
            self.open(tab)
        self.page.evaluate("scrollTo(0, 0)")
        self.keep("-".join(filter(None, (tab, state))))

    def open(self, tab: str) -> None:
        """Open a tab."""
        self.page.evaluate(f"document.getElementById('tab-{tab}').click()")

    def keep(self, name: str) -> None:
        """Make a picture of the window, wherever it is scrolled to."""
        self.page.wait_for_timeout(SETTLED)
        name = f"{name}-{self._end}"
        self.page.screenshot(path=self._folder / f"{name}.png", animations="disabled")


def wait_for(page: Page, state: str) -> None:
    """Wait until the page is in a state."""
    page.wait_for_selector(f'html[data-state="{state}"]', state="attached")


def _address() -> str:
    return f"http://127.0.0.1:{PORT}/"
