"""What each page that people read has to fulfil: axe's rules, sizes, and STOP in sight."""

from __future__ import annotations

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Page

TAGS = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"]
OPTIONS = {
    "runOnly": {"type": "tag", "values": TAGS},
    "rules": {name: {"enabled": True} for name in ("label-content-name-mismatch", "target-size")},
    "resultTypes": ["violations"],
}
SMALL = """() => {
    const kinds = "button, select, input, textarea, summary, a, [role=tab], [role=option], "
        + "[tabindex='0']:not([role=region])";
    const seen = (each) => each.checkVisibility({ visibilityProperty: true })
        && !each.closest(".skip, p, .hidden-text");
    return Array.from(document.querySelectorAll(kinds)).filter(seen).map((each) => {
        const own = each.getBoundingClientRect();
        const label = each.matches("input") && each.closest("label")?.getBoundingClientRect();
        const least = each.matches("#stop-button, .jog-button, .stop-arm") ? 44 : 24;
        const { width, height } = label && label.height > own.height ? label : own;
        return [each.outerHTML.slice(0, 120), Math.round(width), Math.round(height), least];
    }).filter(([, width, height, least]) => width < least || height < least);
}"""
STOP_SEEN = """() => {
    const button = document.getElementById("stop-button");
    const { left, right, top, bottom } = button.getBoundingClientRect();
    const corners = [[left + 10, top + 10], [right - 10, top + 10],
        [left + 10, bottom - 10], [right - 10, bottom - 10]];
    return corners.every(([x, y]) => document.elementFromPoint(x, y)?.closest("#stop-button"));
}"""
WIDE = "() => document.documentElement.scrollWidth - document.documentElement.clientWidth"


def violations(page: Page) -> list[str]:
    """Return the errors that axe finds in the visible part."""
    found = Axe().run(page, options=OPTIONS).response["violations"]
    return [f"{each['id']}: {node['html'][:200]}" for each in found for node in each["nodes"]]
