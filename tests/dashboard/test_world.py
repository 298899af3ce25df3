"""The bodies around a simulated arm: the page shows them live, and disturbs them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from bioscara.robot.tasks.scope import Scope
from dashboard.rig import NO_WEBGL, Site, open_page, page_of, require_browser, site
from physics.worlds import FLOOR, A, pick
from programs import wait_until

pytestmark = pytest.mark.browser

DRAWN = """name => {
  const group = bioscara.view?.drawing.bodies.byName.get(name);
  return group ? [...group.position.toArray(), ...group.quaternion.toArray()] : null;
}"""


@pytest.fixture(scope="module")
def world() -> Iterator[Site]:
    """Serve an arm in a world, whose time is fast."""
    require_browser()
    with site(original="WORLD", speed=5.0) as made:
        yield made


@pytest.fixture(scope="module")
def page(browser: Browser, world: Site) -> Iterator[Page]:
    """Return a page that operates the arm."""
    with page_of(browser, world) as opened:
        opened.get_by_role("tab", name="Simulation").click()
        wait_until(lambda: drawn(opened, "plate"), "the bodies are drawn")
        yield opened


def drawn(page: Page, name: str) -> Any:
    """Return where a body is drawn, x y z and the quaternion x y z w; None if it is not."""
    return page.evaluate(DRAWN, name)


def card(page: Page, name: str) -> Locator:
    """Return the part of the panel with a disturbance."""
    return page.get_by_role("region", name=name, exact=True)


def test_disturbances_need_no_lease_and_are_seen(page: Page, world: Site) -> None:
    simulation = world.robot.simulation
    world.robot.acquire_lease(force=True)
    assert drawn(page, "plate")[:3] == pytest.approx([A.x, A.y, FLOOR], abs=1e-3)
    assert drawn(page, "left jaw") is None
    tilt = card(page, "Tilt a nest")
    tilt.locator("select").select_option("b")
    tilt.get_by_role("button", name="Tilt it").click()
    wait_until(lambda: abs(drawn(page, "b")[4]) > 0.007, "the nest is drawn tilted")
    push = card(page, "Push a body")
    push.locator("select").select_option("spare")
    for value, field in zip(("0", "0", "3", "0.2"), push.locator("input").all(), strict=True):
        field.fill(value)
    code = push.locator("button.copy-python").evaluate("(button) => button.python()")
    assert code == 'robot.simulation.push("spare", (0.0, 0.0, 3.0), 0.2)'
    push.get_by_role("button", name="Push it").click()
    wait_until(lambda: drawn(page, "spare")[2] > 0.02, "the plate is drawn in the air")
    obstacle = card(page, "Put an obstacle")
    obstacle.get_by_role("button", name="Put it there").click()
    wait_until(lambda: drawn(page, "obstacle"), "the obstacle is drawn")
    assert simulation.pose("obstacle")[1:4] == pytest.approx(drawn(page, "obstacle")[:3])
    code = obstacle.locator("button.copy-python").evaluate("(button) => button.python()")
    remove = card(page, "Take a body away")
    remove.locator("select").select_option("obstacle")
    remove.get_by_role("button", name="Take it away").click()
    wait_until(lambda: drawn(page, "obstacle") is None, "it is not drawn any more")
    exec(code, {"robot": world.robot})
    wait_until(lambda: drawn(page, "obstacle"), "the code does the same")
    simulation.take_away("obstacle")
    world.robot.release_lease()


def test_a_refused_disturbance_says_why(page: Page, world: Site) -> None:
    push = card(page, "Push a body")
    push.locator("input").first.fill("1000")
    push.get_by_role("button", name="Push it").click()
    expect(page.locator("#messages")).to_contain_text("force")


def test_the_page_says_what_is_held_and_draws_the_jaws_where_they_are(
    page: Page, world: Site
) -> None:
    robot: Any = world.robot
    held = page.locator(".view-held")
    expect(held).to_have_text("Holds nothing.")
    robot.enable()
    robot.gripper.enable()
    robot.gripper.open()
    pick(robot, A)
    expect(held).to_have_text("Holds plate.")
    wait_until(lambda: drawn(page, "plate")[2] > 0.08, "the plate is drawn at the jaws")
    width = page.evaluate("bioscara.view.picture.positions.gripper")
    assert width == pytest.approx(robot.simulation.width, abs=5e-4)
    assert width > robot.gripper.width + 5e-4  # commanded further than the plate is wide
    robot.release_lease()


def test_who_looks_only_sees_the_world_and_disturbs_nothing(browser: Browser, world: Site) -> None:
    with page_of(browser, world, Scope.VIEW) as page:
        page.get_by_role("tab", name="Simulation").click()
        wait_until(lambda: drawn(page, "plate"), "the bodies are drawn")
        expect(card(page, "Push a body").get_by_role("button", name="Push it")).to_be_disabled()


def test_without_webgl_the_outlines_of_the_bodies_are_drawn(browser: Browser, world: Site) -> None:
    with browser.new_context(viewport={"width": 1440, "height": 900}) as context:
        context.add_init_script(f"({NO_WEBGL})()")
        page = open_page(context, world)
        outlines = page.locator(".view-flat .bodies polygon")
        shapes = [body for body in world.robot.simulation.bodies if body.kind != "jaw"]
        expect(outlines).to_have_count(2 * len(shapes))
        number = [body.name for body in shapes].index("a")
        wait_until(lambda: bool(outlines.nth(number).get_attribute("points")), "they are drawn")
        corners = [
            pair.split(",") for pair in str(outlines.nth(number).get_attribute("points")).split()
        ]
        middle = [sum(float(pair[axis]) for pair in corners) / len(corners) for axis in (0, 1)]
        assert middle == pytest.approx([1e3 * A.x, -1e3 * A.y], abs=1.0)
