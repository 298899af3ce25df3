"""The dashboard in a browser: times from arm to screen and from key to arm, cost, size.

The limits are the budgets of the page, times and sizes that a person notices. The browser draws
without a graphics processor here, which is not counted where the page's own time is.
"""

from __future__ import annotations

import itertools
import json
import os
import re
import shutil
import statistics
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, Page, sync_playwright

from benchmarks.measure import Row
from benchmarks.web import _line, _process

COLD, PRESSES, WATCHED, USED = 5, 30, 8.0, 150.0
"""Loads from a cold cache; presses of a key; time of watching and of scripted use [s]."""
Cycle = tuple[float, int, float]
"""Wall time of its end [s], number, setpoint of the first joint [rad]."""
STEP = 1e-7
"""Least change of a setpoint that counts [rad]."""
NOTED = """() => {
    window.shown = [];
    bioscara.arm.on("sample", () => {
        const { cycle } = bioscara.arm.sample;
        // After the frame in which all listeners draw it.
        const { port1, port2 } = new MessageChannel();
        port1.onmessage = () => shown.push([cycle, Date.now() / 1000]);
        port2.postMessage(null);
    });
    window.keys = [];
    for (const kind of ["keydown", "keyup"]) {
        addEventListener(kind, (event) => {
            if (!event.repeat) keys.push([kind, Date.now() / 1000]);
        }, { capture: true });
    }
}"""
SIZE = """() => {
    const every = ["navigation", "resource"].flatMap((kind) => performance.getEntriesByType(kind));
    const files = every.filter(({ name }) => !/\\/api\\/(?!meshes|model)/.test(name));
    return files.reduce((sum, each) => sum + each.encodedBodySize, 0);
}"""
DRAWN = "() => document.querySelector('.view-canvas canvas')?.width ? performance.now() : 0"


@contextmanager
def _site() -> Iterator[tuple[str, list[Any]]]:
    """Serve an arm and its page; yields the address and the processes of arm and gateway."""
    with (
        tempfile.TemporaryDirectory(prefix="b") as folder,
        _process("-m", "benchmarks.dashboard_parts", "bench", BIOSCARA_RUNTIME=folder) as arm,
    ):
        assert _line(arm) == "ready\n"
        words = ("-m", "bioscara", "web", "--arm", "bench", "--port", "0")
        with _process(*words, BIOSCARA_RUNTIME=folder) as gateway:
            found = re.search(r"(http://\S+/)", _line(gateway))
            assert found is not None
            token = json.loads((Path(folder) / "bench.tokens").read_text())["operate"]
            yield f"{found[1]}#token={token}", [arm, gateway]


def rows() -> list[Row]:
    """Measure all budgets with one served arm and one browser."""
    chromium = shutil.which("chromium")
    if chromium is None:
        raise SystemExit("the benchmark of the dashboard needs Chromium: apt install chromium")
    with _site() as (url, processes), sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, chromium_sandbox=False)
        paints = [_first_paint(browser, url) for _ in range(COLD)]
        idle = _processor_time(processes, WATCHED)
        page = browser.new_context(viewport={"width": 1440, "height": 900}).new_page()
        page.goto(url)
        page.wait_for_function(DRAWN)
        page.evaluate(NOTED)
        cost = _processor_time(processes, WATCHED) - idle
        frame = _frame_time(page)
        _press_keys(page)
        heap, hour = _heap(page)
        size = float(page.evaluate(SIZE))
        shown, keys = page.evaluate("[shown, keys]")
        browser.close()
        processes[0].stdin.write("\n")
        processes[0].stdin.flush()
        cycles: list[Cycle] = [tuple(each) for each in json.loads(_line(processes[0]))]
    ends = {number: wall for wall, number, _ in cycles}
    pixels = [wall - ends[number] for number, wall in shown if number in ends]
    moved, slowed = _reactions(cycles, keys)
    load = f"load of the computer {os.getloadavg()[0]:.1f}"
    return [
        _row("first picture of the arm, cold cache", statistics.median(paints), 1.5, "s", load),
        _row("files of the page, compressed", size / 1e3, 450.0, "kB"),
        _row("script, style and layout of a frame, with plots", 1e3 * frame, 8.0, "ms"),
        _row("end of a cycle to its picture, p95", 1e3 * _p95(pixels), 60.0, "ms"),
        _row("jog key to the first setpoint, p95", 1e3 * _p95(moved), 40.0, "ms"),
        _row("release to the first slower setpoint, p95", 1e3 * _p95(slowed), 60.0, "ms"),
        _row("owner and gateway for one page", 100 * cost / WATCHED, 5.0, "% of a core"),
        _row(
            "heap after an hour, extrapolated", hour / 1e6, 60.0, "MB", f"now {heap / 1e6:.1f} MB"
        ),
    ]


def _row(what: str, value: float, limit: float, unit: str, note: str = "") -> Row:
    measured = f"{value:.3g} {unit}" + (f" ({note})" if note else "")
    return Row(what, measured, "a budget", f"at most {limit:g} {unit}", value <= limit)


def _p95(values: Sequence[float]) -> float:
    return sorted(values)[len(values) * 95 // 100]


def _first_paint(browser: Browser, url: str) -> float:
    """Return the time from navigation to the first picture of the arm, without a cache [s]."""
    context = browser.new_context(viewport={"width": 1440, "height": 900})
    page = context.new_page()
    page.goto(url)
    found = float(page.wait_for_function(DRAWN).json_value()) / 1e3
    context.close()
    return found


def _processor_time(processes: Sequence[Any], watched: float) -> float:
    """Return the processor time that processes use while they are watched [s]."""
    before = sum(map(_used, processes))
    time.sleep(watched)
    return sum(map(_used, processes)) - before


def _used(process: Any) -> float:
    fields = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _frame_time(page: Page) -> float:
    """Return the main thread's own time for one frame with all plots [s]."""
    page.evaluate("document.getElementById('tab-plots').click()")
    page.wait_for_timeout(1000)
    devtools = page.context.new_cdp_session(page)
    devtools.send("Performance.enable")

    def spent() -> tuple[float, int]:
        metrics = {
            m["name"]: m["value"] for m in devtools.send("Performance.getMetrics")["metrics"]
        }
        kinds = ("ScriptDuration", "LayoutDuration", "RecalcStyleDuration")
        return sum(metrics[kind] for kind in kinds), page.evaluate("shown.length")

    before, first = spent()
    page.wait_for_timeout(1e3 * WATCHED)
    after, last = spent()
    return (after - before) / max(last - first, 1)


def _press_keys(page: Page) -> None:
    page.get_by_role("button", name="Take control").click()
    page.wait_for_selector("html[data-state=commanding]")
    page.locator(".jog-pad").focus()
    for number in range(PRESSES):
        key = "ArrowLeft" if number % 2 else "ArrowRight"
        page.keyboard.down(key)
        # Not in step with the cycles; short ones end while the arm still accelerates.
        page.wait_for_timeout(100 + 17 * number)
        page.keyboard.up(key)
        page.wait_for_timeout(500)


def _reactions(
    cycles: Sequence[Cycle], keys: Sequence[tuple[str, float]]
) -> tuple[list[float], list[float]]:
    """Return the times from presses to motion, and from releases to slower setpoints [s]."""
    moved, slowed = [], []
    steps = [abs(now[2] - was[2]) for was, now in itertools.pairwise(cycles)]
    for kind, pressed in keys:
        begin = next(index for index, (wall, _, _) in enumerate(cycles) if wall > pressed)
        for index in range(begin, len(cycles) - 1):
            # Setpoint of the cycle less that of the former one.
            step, former = steps[index - 1], steps[index - 2]
            if kind == "keydown" and step > STEP:
                moved.append(cycles[index][0] - pressed)
                break
            if kind == "keyup" and step < former - STEP:
                slowed.append(cycles[index][0] - pressed)
                break
    return moved, slowed


def _heap(page: Page) -> tuple[float, float]:
    """Use the page for a while; return its heap [byte] then, and as it would be after an hour."""
    devtools = page.context.new_cdp_session(page)

    def used() -> float:
        page.evaluate("() => { shown.length = Math.min(shown.length, 2000); }")
        for _ in range(2):
            devtools.send("HeapProfiler.collectGarbage")
        return float(devtools.send("Runtime.getHeapUsage")["usedSize"])

    begin = time.monotonic()
    samples: list[tuple[float, float]] = []
    tabs = page.locator("#tabs [role=tab]:visible").all()
    while time.monotonic() < begin + USED:
        for tab in tabs:
            tab.click()
            page.wait_for_timeout(150)
        page.locator(".jog-pad").focus()
        key = "ArrowLeft" if len(samples) % 2 else "ArrowRight"
        page.keyboard.down(key)
        page.wait_for_timeout(200)
        page.keyboard.up(key)
        samples.append((time.monotonic() - begin, used()))
    # Rings and caches are filled first.
    later = samples[len(samples) // 3 :]
    slope = statistics.linear_regression(*zip(*later, strict=True)).slope
    return samples[-1][1], samples[-1][1] + max(slope, 0.0) * 3600.0
