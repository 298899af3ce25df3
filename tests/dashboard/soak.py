"""An hour of one page: jogs, plans, uploads, tabs; run by ``make page-soak``.

A person's hour at the arm, by a script in the tests' browser. Once a minute the garbage is
collected, and heap, nodes and listeners of the page and the memory of owner and gateway are noted.
In the last quarter they must be those of the second: in the first one the rings of the plots and
the events fill up.

``BIOSCARA_SOAK_MINUTES`` is the duration, 60 unless given.
"""

from __future__ import annotations

import itertools
import os
import statistics
import sys
import time
from pathlib import Path
from typing import NamedTuple

from playwright.sync_api import Error, Page, sync_playwright

from dashboard.rig import Site, at_rest, command, launched, open_page, site, upload
from programs import wait_until
from served import HALF

MINUTES = float(os.environ.get("BIOSCARA_SOAK_MINUTES", "60"))
GROWTH = 0.1
"""Share by which a quantity may have grown from the second quarter to the last one."""


class Use(NamedTuple):
    """What page and server use.

    Attributes:
        heap: Of the page, after a collection of garbage [MB].
        nodes: Nodes of all documents.
        listeners: Listeners of events.
        memory: Resident memory of owner and gateway [MB].
    """

    heap: float
    nodes: float
    listeners: float
    memory: float


class Hour:
    """Uses a page as a person does."""

    def __init__(self, page: Page, left: Site) -> None:
        self._page, self._left = page, left
        self._devtools = page.context.new_cdp_session(page)
        self._side = itertools.cycle((0, 1))
        self._height = left.robot.pose.z
        self._acts = self._look, self._jog, self._go, self._preview
        self.rounds = 0

    def round(self) -> None:
        """Do each thing once."""
        for act in self._acts:
            # A page that was late for its lease has given control up.
            if not self._page.evaluate("bioscara.arm.commands"):
                command(self._page)
            act()
            wait_until(lambda: at_rest(self._left.robot), "the arm rests", 20.0)
        self.rounds += 1

    def use(self) -> Use:
        """Return what page and server use now."""
        for _ in range(2):
            self._devtools.send("HeapProfiler.collectGarbage")
        heap = self._devtools.send("Runtime.getHeapUsage")["usedSize"]
        counted = self._devtools.send("Memory.getDOMCounters")
        lines = Path(f"/proc/{self._left.pid}/status").read_text().splitlines()
        memory = next(int(line.split()[1]) for line in lines if line.startswith("VmRSS"))
        return Use(heap / 1e6, counted["nodes"], counted["jsEventListeners"], memory / 1e3)

    def _tab(self, name: str) -> None:
        self._page.get_by_role("tab", name=name, exact=True).click()

    def _look(self) -> None:
        for tab in self._page.locator("#tabs [role=tab]:visible").all():
            tab.click()
            self._page.wait_for_timeout(400)

    def _jog(self) -> None:
        self._page.locator(".jog-pad").focus()
        keys = ["ArrowLeft", "ArrowRight"]
        # Towards the middle first, so that the arm does not drift away.
        for key in keys if self._left.robot.state.positions[0] < HALF[0] else reversed(keys):
            self._page.keyboard.down(key)
            self._page.wait_for_timeout(500)
            self._page.keyboard.up(key)
            wait_until(lambda: at_rest(self._left.robot), "the jog ends")

    def _go(self) -> None:
        self._tab("Run")
        go = self._page.get_by_role("region", name="Go to a pose")
        go.get_by_role("button", name="Fill in").click()
        z = self._height + 0.008 * next(self._side)
        go.locator("#go-z").fill(f"{1000 * z:.1f}")
        go.get_by_role("button", name="Preview", exact=True).click()
        go.get_by_text("The plan takes").wait_for()
        go.get_by_role("button", name="Execute the preview").click()
        self._page.wait_for_timeout(300)

    def _preview(self) -> None:
        self._tab("Files")
        here = self._left.robot.state.positions[0]
        rows = [f"{0.01 * i},{here + (0.35 - here) * i / 399},0.2,0.8,-0.5" for i in range(400)]
        text = "\n".join(["time,j1,j2,j3,j4", *rows, ""])
        upload(self._page, ".yaml,.yml,.csv", "swing.csv", text)
        self._page.get_by_text("swing.csv: 400 points").wait_for()
        self._page.locator("#panel-files").get_by_role("button", name="Preview").click()
        self._page.wait_for_timeout(300)
        self._page.evaluate("bioscara.showPreview(null)")


def run(page: Page, left: Site) -> list[Use]:
    """Use the page for the whole time; return the used resources, minute by minute."""
    hour = Hour(page, left)
    uses: list[Use] = []
    begin = time.monotonic()
    while time.monotonic() < begin + 60.0 * MINUTES:
        hour.round()
        if time.monotonic() > begin + 60.0 * MINUTES * len(uses) / max(MINUTES, 8.0):
            uses.append(hour.use())
            words = [f"{name} {value:.6g}" for name, value in uses[-1]._asdict().items()]
            passed = (time.monotonic() - begin) / 60.0
            print(f"{passed:5.1f} min, {hour.rounds} rounds:", *words, flush=True)  # noqa: T201
    return uses


def grown(uses: list[Use]) -> list[str]:
    """Return the quantities that grew from the second quarter to the last one."""
    quarter = len(uses) // 4
    found = []
    for name in Use._fields:
        early, late = (
            statistics.median(getattr(use, name) for use in part)
            for part in (uses[quarter : 2 * quarter], uses[-quarter:])
        )
        print(f"{name}: {early:.6g}, then {late:.6g}")  # noqa: T201
        if late > (1.0 + GROWTH) * early:
            found.append(f"{name} grew from {early:.6g} to {late:.6g}")
    return found


def main() -> int:
    """Return 1 if something grew, or the page reported an error."""
    with sync_playwright() as playwright, site(*HALF) as left:
        browser = launched(playwright)
        page = open_page(browser.new_context(viewport={"width": 1440, "height": 900}), left)
        command(page)
        try:
            found = [*grown(run(page, left)), *page.errors]  # type: ignore[attr-defined]
        except Error as error:
            found = [str(error), page.locator("body").aria_snapshot()]
        browser.close()
    print(*(found or ["nothing grew"]), sep="\n")  # noqa: T201
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
