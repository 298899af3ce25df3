"""A served arm with its page in a real browser, and a client that sees the arm's motions."""

from __future__ import annotations

import shutil
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from time import sleep
from typing import Any

import pytest
from playwright.sync_api import Browser, BrowserContext, Page

from bioscara import Robot
from bioscara.errors import BioscaraError, LeaseError
from bioscara.remote import RemoteRobot
from bioscara.robot.tasks.scope import Scope
from bioscara.web.access.tokens import load_tokens
from programs import environment, running, wait_for_line, wait_until
from ros_environment import absent
from served import HALF, NAME, runtime_folder

_INSTALLED = shutil.which("chromium") or shutil.which("chromium-browser")
CHROMIUM = str(Path(__file__).with_name("chromium.sh"))
"""Program of the browser."""
NO_BROWSER = "the tests of the page in a browser: `apt install chromium`"
# Of several lists of features the last one counts, so it repeats what playwright has of use here.
# The popups of the address bar are pages of their own for each profile: 0.6 s of computing time.
_WITHOUT = (
    "AvoidUnnecessaryBeforeUnloadCheckSync",
    "DestroyProfileOnBrowserClose",
    "MediaRouter",
    "OptimizationHints",
    "PaintHolding",
    "WebUIOmniboxAimPopup",
    "WebUIOmniboxPopup",
)
ARGUMENTS = ("--no-first-run", "--disable-background-networking", "--disable-component-update",
             "--disable-sync", "--disable-quic",
             f"--disable-features={','.join(_WITHOUT)}")  # fmt: skip
LIVE = ("commanding", "no-lease", "lease-elsewhere", "fault", "recovering")
"""States of a page that has fresh values."""
LIMIT = 10.0
"""Time in which something has to happen [s]."""


class Site:
    """A served arm with its page.

    Attributes:
        url: Address of the page, without a token.
        folder: Runtime folder of the owner.
        robot: A client of the owner, which looks.
        pid: Process of owner and gateway.
    """

    def __init__(
        self, url: str, token_file: str, folder: Path, robot: RemoteRobot, pid: int
    ) -> None:
        self.url, self.folder, self.robot, self.pid = url, folder, robot, pid
        self._tokens = load_tokens(Path(token_file))

    def url_for(self, scope: Scope) -> str:
        """Return the address that signs a browser in."""
        return f"{self.url}#token={self._tokens.of(scope)}"


@contextmanager
def site(*at: float, speed: float = 1.0, original: str = "") -> Iterator[Site]:
    """Serve an arm and its page.

    Args:
        *at: Where it stands, homed; by default far from all limits.
        speed: Factor by which its time is faster than real time.
        original: Names of the joints with original firmware; WORLD for an arm among bodies.
    """
    program = str(Path(__file__).with_name("served_site.py"))
    with runtime_folder() as folder:
        words = [original, str(speed), *map(str, at or HALF)]
        with running(program, *words, env=environment()) as process:
            _, url, token_file = wait_for_line(process, "served").split()
            with Robot.connect(f"arm:{NAME}") as robot:
                yield Site(url, token_file, folder, robot, process.pid)  # type: ignore[arg-type]
            process.send_signal(signal.SIGTERM)


def open_page(
    context: BrowserContext, made: Site, scope: Scope = Scope.OPERATE, *, live: bool = True
) -> Page:
    """Open the page of an arm, signed in; fails where the page reports an error later."""
    page = context.new_page()
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("console", lambda line: errors.append(line.text) if line.type == "error" else None)
    address = made.url_for(scope)
    # A further tab has the cookie of the browser; another sign-in would end that of the first.
    page.goto(address.partition("#")[0] if context.cookies() else address)
    if live:
        wait_for_state(page, *LIVE)
    page.errors = errors  # type: ignore[attr-defined]
    return page


@contextmanager
def page_of(
    browser: Browser,
    made: Site,
    scope: Scope = Scope.OPERATE,
    *,
    size: tuple[int, int] = (1440, 900),
    clean: bool = True,
    **profile: Any,
) -> Iterator[Page]:
    """Open the page in a profile of its own.

    Args:
        browser: The browser.
        made: The arm.
        scope: For what the page is signed in.
        size: Of the window [px].
        clean: Whether no error may have appeared in its console at the end.
        **profile: Further options of the profile.
    """
    with browser.new_context(viewport={"width": size[0], "height": size[1]}, **profile) as context:
        page = open_page(context, made, scope)
        yield page
        assert not clean or page.errors == []  # type: ignore[attr-defined]


def upload(page: Page, kinds: str, name: str, content: str | bytes) -> None:
    """Give a file to the field that takes files of these kinds."""
    data = content.encode() if isinstance(content, str) else content
    page.locator(f"input[type=file][accept='{kinds}']").set_input_files(
        {"name": name, "mimeType": "text/plain", "buffer": data}
    )


NO_WEBGL = """() => {
  const get = HTMLCanvasElement.prototype.getContext;
  HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
    return kind.startsWith("webgl") ? null : get.call(this, kind, ...rest);
  };
}"""
"""Takes WebGL from the browser."""
DIALOG = """async () => {
    const { openDialog } = await import("/js/dialog.js");
    openDialog(bioscara, "A question", () => [document.createElement("input")]);
}"""
"""Opens a dialog."""


def recover(robot: RemoteRobot) -> None:
    """Recover the arm, whose fault may need a moment until its evidence is kept."""

    def recovered() -> bool:
        with suppress(BioscaraError):
            robot.acquire_lease(force=True)
            robot.acknowledge()
            robot.recover()
            robot.enable()
            return True
        return False

    wait_until(recovered, "the arm has recovered")
    robot.release_lease()


def wait_for_state(page: Page, *states: str) -> None:
    """Wait until the page is in one of the states."""
    listed = ", ".join(f'[data-state="{state}"]' for state in states)
    page.wait_for_selector(f"html:is({listed})", state="attached", timeout=1e3 * LIMIT)


def command(page: Page) -> None:
    """Take the lease for the page, as its button does."""
    page.locator("#lease-take").click()
    # Asked for again and again: waiting within the page needs eval, which it does not allow.
    wait_until(lambda: bool(page.evaluate("bioscara.arm.commands")), "the page has the lease")


def at_rest(robot: RemoteRobot) -> bool:
    """Return whether nothing moves the arm, as the owner knows it."""
    return not robot.is_moving


def positions(robot: RemoteRobot) -> tuple[float, ...]:
    """Return the measured positions of the joints [rad or m]."""
    return tuple(robot.state.positions)


def moves(robot: RemoteRobot, work: Callable[[], Any], *, least: float = 1e-3) -> None:
    """Do something, and require that the arm moves then."""
    before = positions(robot)
    work()
    wait_until(
        lambda: max(abs(a - b) for a, b in zip(positions(robot), before, strict=True)) > least,
        "the arm moves",
    )


def swing(robot: RemoteRobot) -> None:
    """Let a client move the arm slowly for some seconds, and wait until it does."""
    here = robot.state.positions[0]
    goal = HALF[0] + (0.2 if here < HALF[0] else -0.2)

    def moves() -> bool:
        if at_rest(robot):
            # A page repeats STOP until it is confirmed: a late copy ends this lease, too.
            with suppress(LeaseError):
                robot.acquire_lease(force=True)
                robot.move_joints((goal, *HALF[1:]), velocity_scaling=0.1, wait=False)
        return abs(robot.state.velocities[0]) > 0.02

    wait_until(moves, "the arm moves")


def stays(robot: RemoteRobot, time: float = 0.15) -> None:
    """Require that the arm rests, and stays where it is for a while [s]."""
    wait_until(lambda: max(map(abs, robot.state.velocities)) < 1e-3, "the arm rests", 1.0)
    before = positions(robot)
    sleep(time)
    assert at_rest(robot)
    assert positions(robot) == pytest.approx(before, abs=2e-4)


def require_browser() -> None:
    """Skip where there is no browser."""
    if _INSTALLED is None:
        absent(NO_BROWSER)


def launched(playwright: Any) -> Browser:
    """Start the browser."""
    browser: Browser = playwright.chromium.launch(
        executable_path=CHROMIUM, args=list(ARGUMENTS), chromium_sandbox=False
    )
    return browser
