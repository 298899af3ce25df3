"""The accessibility tree of the browser, from which a screen reader reads each tab and event."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import pytest
from playwright.sync_api import Browser, CDPSession, Page

from bioscara.robot.tasks.scope import Scope
from dashboard.rig import Site, at_rest, command, page_of, recover, swing, wait_for_state
from programs import wait_until

pytestmark = pytest.mark.browser

TABS = ("Run", "Teach", "Files", "Plots", "Health", "Settings", "Simulation")
CONTROLS = {
    "button", "textbox", "searchbox", "spinbutton", "slider", "checkbox", "radio", "combobox",
    "listbox", "tab", "link", "option", "DisclosureTriangle", "application",
}  # fmt: skip
GROUPS = {"group", "region", "tabpanel", "list", "log", "generic"}
"""Roles of what takes the focus to be scrolled, or on the way to a control in it."""
STATE = {"tab": "selected", "checkbox": "checked", "radio": "checked", "option": "selected",
         "DisclosureTriangle": "expanded"}  # fmt: skip
"""The state that a control of a role has in the tree."""


class Node(NamedTuple):
    """An element of the tree.

    Attributes:
        role: Its role.
        name: Its name.
        value: Its value, for a control that has one.
        facts: States and properties by name.
        text: The names of all that is in it.
    """

    role: str
    name: str
    value: Any
    facts: dict[str, Any]
    text: str


class Reader:
    """Reads the accessibility tree of a page."""

    def __init__(self, page: Page) -> None:
        self._devtools: CDPSession = page.context.new_cdp_session(page)

    def nodes(self) -> list[Node]:
        """Return the elements, in the order of the page."""
        given = self._devtools.send("Accessibility.getFullAXTree")["nodes"]
        by_id = {each["nodeId"]: each for each in given}

        def text_of(each: dict[str, Any]) -> str:
            if each["role"]["value"] == "StaticText":
                return str(each["name"]["value"])
            inner = [by_id[child] for child in each.get("childIds", ()) if child in by_id]
            return " ".join(filter(None, map(text_of, inner)))

        return [
            Node(
                each["role"]["value"],
                each.get("name", {}).get("value", ""),
                each.get("value", {}).get("value"),
                {fact["name"]: fact["value"].get("value") for fact in each.get("properties", ())},
                text_of(each),
            )
            for each in given
            if not each.get("ignored") and each["role"]["value"] != "InlineTextBox"
        ]

    def live(self, urgency: str) -> list[str]:
        """Return the texts of the regions whose changes are announced.

        Args:
            urgency: ``polite``, or ``assertive`` for those that interrupt.
        """
        return [node.text for node in self.nodes() if node.facts.get("live") == urgency]


@pytest.fixture(scope="module")
def page(browser: Browser, left: Site) -> Iterator[Page]:
    """Return a page signed in as administrator, which the tests share."""
    with page_of(browser, left, Scope.ADMIN) as opened:
        yield opened


@pytest.fixture
def reader(page: Page) -> Reader:
    return Reader(page)


@pytest.mark.parametrize("tab", TABS)
def test_each_control_of_a_tab_has_role_name_and_state(
    page: Page, reader: Reader, tab: str
) -> None:
    page.get_by_role("tab", name=tab).click()
    page.evaluate("document.querySelectorAll('details').forEach((each) => { each.open = true; })")
    nodes = reader.nodes()
    controls = [node for node in nodes if node.role in CONTROLS]
    focusable = [
        node for node in nodes if node.facts.get("focusable") and node.role != "RootWebArea"
    ]
    assert len(controls) > 15
    assert [node for node in [*controls, *focusable] if not node.name.strip()] == []
    # What takes the focus is a control, or says that it is a group, a region or the like.
    assert {node.role for node in focusable} <= CONTROLS | GROUPS
    usable = [n for n in controls if not n.facts.get("disabled")]
    stateless = [n for n in usable if n.role in STATE and STATE[n.role] not in n.facts]
    assert stateless == []
    chosen = [n.name for n in controls if n.role == "tab" and n.facts["selected"]]
    assert chosen == [tab]
    panels = [node.name for node in nodes if node.role == "tabpanel"]
    assert panels == [tab]


def test_toggles_and_buttons_without_effect_are_marked_as_such(page: Page, reader: Reader) -> None:
    page.get_by_role("tab", name="Run").click()
    if page.locator("html").get_attribute("data-state") == "commanding":
        page.get_by_role("button", name="Give back").click()
    wait_for_state(page, "no-lease")
    buttons = {node.name: node.facts for node in reader.nodes() if node.role == "button"}
    assert (buttons["Joints"]["pressed"], buttons["Tool"]["pressed"]) == ("true", "false")
    # Without control the arm cannot be homed, and the button says why; STOP can be pressed.
    assert buttons["Home"]["disabled"]
    assert "disabled" not in buttons["STOP"]
    assert page.get_by_role("button", name="Home", exact=True).get_attribute("title")
    stop = page.get_by_role("button", name="STOP", exact=True)
    assert "not an emergency stop" in str(page.locator("#stop-description").text_content())
    assert stop.get_attribute("aria-describedby") == "stop-description"


def test_who_commands_and_the_state_of_the_arm_are_announced(page: Page, reader: Reader) -> None:
    if page.locator("html").get_attribute("data-state") != "commanding":
        command(page)
    wait_until(lambda: "You command the arm" in reader.live("polite"), "it is announced")
    assert any("you command" in text and "ready" in text for text in reader.live("polite"))
    page.get_by_role("button", name="Give back").click()
    wait_until(lambda: "Nobody commands the arm" in reader.live("polite"), "it is announced")


@pytest.mark.parametrize("tab", TABS)
def test_a_stop_is_announced_in_each_tab(page: Page, left: Site, reader: Reader, tab: str) -> None:
    page.get_by_role("tab", name=tab).click()
    swing(left.robot)
    page.get_by_role("button", name="STOP", exact=True).press("Enter")
    wait_until(
        lambda: any("At rest" in text for text in reader.live("assertive")), "it is announced"
    )
    assert at_rest(left.robot)
    page.locator(".stop-box button").click()
    left.robot.release_lease()


def test_a_fault_and_its_remedy_interrupt_what_is_read(
    page: Page, left: Site, reader: Reader
) -> None:
    left.robot.acquire_lease(force=True)
    try:
        left.robot.simulate_fault("overheat", "j2")
        wait_for_state(page, "fault")
        remedy = ("Recover", "Acknowledge")
        wait_until(
            lambda: any(word in text for text in reader.live("assertive") for word in remedy),
            "it is announced",
        )
        wait_until(lambda: any("fault" in text for text in reader.live("polite")), "the state is")
    finally:
        left.robot.simulate_fault("overheat", "j2", 0.0)
        recover(left.robot)
    wait_for_state(page, "no-lease")
    assert not any("Recover" in text for text in reader.live("assertive"))
