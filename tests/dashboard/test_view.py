"""The view shows the arm where it is, says when it does not know, and moves it by plans alone."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page

from bioscara import Box, Scene, Trajectory
from dashboard.rig import NO_WEBGL, Site, command, open_page, page_of
from programs import wait_until

pytestmark = pytest.mark.browser

DRAWN = "() => Boolean(window.bioscara?.view?.scheduler.frames > 1)"
AT_HANDLE = """() => {
  const { view } = bioscara;
  const { handle, stage } = view.drawing;
  const place = handle.group.position.clone().project(stage.camera);
  const box = stage.host.getBoundingClientRect();
  return [box.left + (place.x + 1) / 2 * box.width, box.top + (1 - place.y) / 2 * box.height];
}"""


@pytest.fixture(scope="module")
def shared(browser: Browser, left: Site) -> Iterator[Page]:
    """Return a page that the tests of this module share."""
    with page_of(browser, left) as page:
        _drawn(page)
        yield page


@pytest.fixture
def page(shared: Page, left: Site) -> Iterator[Page]:
    """Return the shared page without a target, a plan or the lease, in an empty scene."""
    yield shared
    shared.evaluate("() => { bioscara.view.target.show(false); bioscara.showPreview(null); }")
    shared.evaluate("() => bioscara.arm.release()")
    left.robot.acquire_lease(force=True)
    left.robot.stop()
    left.robot.acquire_lease()
    if left.robot.scene.zones:
        left.robot.scene = Scene()
    left.robot.release_lease()
    _until(shared, "bioscara.arm.lease?.client === null")


def _drawn(page: Page) -> None:
    wait_until(lambda: page.evaluate(DRAWN), "the view is drawn")


def _until(page: Page, condition: str) -> None:
    # The page's policy forbids the evaluation that wait_for_function uses.
    wait_until(lambda: page.evaluate(f"() => Boolean({condition})"), condition)


def _tool(page: Page, room: str = "live") -> list[float]:
    """Return the pose of the tool as it is drawn [m, m, m, rad]."""
    pose: list[float] = page.evaluate(
        f"""() => {{ const {{ picture }} = bioscara.view;
          return picture.kinematics.toolPose(picture.{room}, picture.tool); }}"""
    )
    return pose


def _show_target(page: Page, *pose: float) -> None:
    page.get_by_role("button", name="Target", exact=True).click()
    if pose:
        page.evaluate("pose => bioscara.view.target.set(pose)", list(pose))


def _plan(page: Page) -> None:
    page.get_by_role("button", name="Plan", exact=True).click()
    page.locator(".view-plan").wait_for(state="visible")


def _near(robot: Any, *by: float) -> list[float]:
    """Return the pose of the tool, displaced."""
    return [a + b for a, b in zip(robot.pose, (*by, 0.0), strict=True)]


def _frames(page: Page) -> int:
    number: int = page.evaluate("() => bioscara.view.scheduler.frames")
    return number


def _move(left: Site, joints: Sequence[float]) -> None:
    left.robot.move_joints(list(joints))
    left.robot.release_lease()


def test_the_links_are_where_the_kinematics_of_python_have_them(page: Page, left: Site) -> None:
    random = np.random.default_rng(3)
    joints = left.robot.parameters.joints
    for _ in range(20):
        at = [float(random.uniform(joint.lower, joint.upper)) for joint in joints]
        pose = page.evaluate(
            """at => { const { kinematics, tool } = bioscara.view.picture;
              const room = kinematics.room();
              const named = kinematics.names.map((name, index) => [name, at[index]]);
              kinematics.place(Object.fromEntries(named), room);
              return kinematics.toolPose(room, tool); }""",
            at,
        )
        expected = left.robot.kinematics.forward(at)
        assert pose[:3] == pytest.approx(expected[:3], abs=1e-6)
        turn = (pose[3] - expected.yaw + np.pi) % (2 * np.pi) - np.pi
        assert turn == pytest.approx(0.0, abs=1e-6)


def test_the_jaws_are_as_far_apart_as_the_width(page: Page) -> None:
    apart = page.evaluate(
        """width => { const { kinematics } = bioscara.view.picture;
          const room = kinematics.room();
          kinematics.place({ gripper: width }, room);
          const [a, b] = ["left_jaw_link", "right_jaw_link"].map(name => room.get(name));
          return Math.hypot(a[12] - b[12], a[13] - b[13], a[14] - b[14]); }""",
        0.07,
    )
    assert apart == pytest.approx(0.07, abs=1e-9)


def test_the_tool_is_drawn_where_the_arm_has_it_and_only_on_change(page: Page, left: Site) -> None:
    _move(left, [0.1, 0.2, 0.9, -0.5])
    pose = left.robot.pose
    assert pose is not None
    wait_until(lambda: _tool(page)[:3] == pytest.approx(pose[:3], abs=1e-4), "it is drawn there")
    assert page.evaluate("bioscara.view.picture.trace.count") > 2
    standing = _frames(page)
    page.wait_for_timeout(500)
    assert _frames(page) <= standing + 4  # not one for each of a dozen samples


def test_a_trajectory_is_interpolated_as_python_does(page: Page, left: Site) -> None:
    times, positions = [0.0, 0.4, 1.0], [[0.0, 0.1], [0.3, 0.12], [0.1, 0.1]]
    velocities, accelerations = [[0.1, 0.0], [0.2, 0.01], [0.0, 0.0]], [[0.5, 0], [0, 0.1], [0, 0]]
    for given in ((), (velocities,), (velocities, accelerations)):
        curve = Trajectory(("j1", "j2"), times, positions, *given)
        value = {
            "joint_names": ["j1", "j2"], "times": times, "positions": positions,
            "velocities": velocities if given else None,
            "accelerations": accelerations if len(given) > 1 else None,
        }  # fmt: skip
        for time in (-1.0, 0.0, 0.1, 0.4, 0.77, 1.0, 9.0):
            at = page.evaluate(
                """async ([value, time]) => {
                  const { TrajectoryCurve } = await import("/js/view/trajectory_curve.js");
                  const { j1, j2 } = new TrajectoryCurve(value).at(time);
                  return [j1, j2]; }""",
                [value, time],
            )
            assert at == pytest.approx(curve.sample(time).positions, abs=1e-12)


def test_values_that_are_not_live_are_grey_and_dated(page: Page) -> None:
    subscribe = """states => bioscara.connection.request({
      kind: "subscribe", states, period: 0.04, unconfirmed: 2,
      events_after: bioscara.arm.lastEvent,
    })"""
    page.evaluate(subscribe, False)
    banner = page.locator(".view-banner")
    banner.wait_for(state="visible")
    wait_until(lambda: "NOT LIVE" in banner.inner_text(), "the view says that it is not live")
    _until(page, "bioscara.view.drawing.body.tint !== ''")
    assert "unknown" in page.locator(".view-clearance").inner_text()
    page.evaluate(subscribe, True)
    banner.wait_for(state="hidden")
    _until(page, "bioscara.view.drawing.body.tint === ''")


def test_the_text_alternative_has_the_pose(page: Page, left: Site) -> None:
    pose = left.robot.pose
    assert pose is not None
    said = page.locator("#view-said")
    wait_until(lambda: f"x {1e3 * pose.x:.1f} mm" in said.inner_text(), "the pose is told")
    picture = page.get_by_role("application")
    assert picture.get_attribute("aria-describedby") == "view-said"


def test_the_picture_is_turned_by_keys_and_buttons(page: Page) -> None:
    place = "() => bioscara.view.drawing.stage.camera.position.toArray()"
    page.get_by_role("application").focus()
    views = [page.evaluate(place)]
    for key in ("ArrowLeft", "ArrowUp", "Shift+ArrowRight", "+"):
        page.keyboard.press(key)
        views.append(page.evaluate(place))
    page.get_by_role("button", name="Look from: Side").click()
    views.append(page.evaluate(place))
    page.locator("summary", has_text="Camera").click()
    page.get_by_role("button", name="Turn right").click()
    views.append(page.evaluate(place))
    page.locator("summary", has_text="Camera").click()
    assert len({tuple(view) for view in views}) == len(views)
    page.get_by_role("button", name="Look from: Oblique").click()


def test_the_clearance_is_that_of_python(page: Page, left: Site) -> None:
    x, y, z, _ = left.robot.pose
    left.robot.scene = Scene(
        zones=(Box("rack", (x - 0.1, y - 0.1, 0), (x + 0.1, y + 0.1, z - 0.03)),)
    )
    left.robot.release_lease()
    shown = page.locator(".view-clearance")
    wait_until(lambda: "to rack" in shown.inner_text(), "the rack is the nearest")
    expected = left.robot.scene.nearest_pair(left.robot.kinematics, left.robot.state.positions)
    assert expected is not None
    assert f"{1e3 * expected.distance:.1f} mm, {expected.link} to rack" in shown.inner_text()
    _until(page, "bioscara.view.drawing.tracks.pair.visible")


def test_a_plan_is_executed_by_a_second_press_and_with_the_lease_alone(
    page: Page, left: Site
) -> None:
    goal = _near(left.robot, 0.0, 0.0, 0.01)
    _show_target(page)
    page.get_by_role("button", name="more z", exact=True).click()
    _plan(page)
    execute = page.get_by_role("button", name="Execute")
    assert execute.is_disabled()
    assert "Take control" in page.locator("#plan-status").inner_text()
    # The plan is shown at its end, where the arm does not hide it.
    wait_until(lambda: _tool(page, "plannedRoom")[:3] == pytest.approx(goal[:3], abs=1e-4), "ghost")
    slider = page.get_by_label("Time in the plan")
    slider.focus()
    page.keyboard.press("Home")
    _until(page, "bioscara.preview.time === 0")
    page.keyboard.press("End")
    _until(page, "bioscara.preview.time > 0")
    wait_until(lambda: _tool(page, "plannedRoom")[:3] == pytest.approx(goal[:3], abs=1e-4), "ghost")
    assert left.robot.pose[2] == pytest.approx(goal[2] - 0.01, abs=1e-4)
    command(page)
    wait_until(execute.is_enabled, "it can be executed")
    execute.click()
    page.locator(".view-plan").wait_for(state="hidden")
    assert left.robot.pose == pytest.approx(goal, abs=1e-4)


def test_a_plan_that_is_executed_is_shown_where_the_arm_is_in_it(page: Page, left: Site) -> None:
    _show_target(page, *_near(left.robot, 0.0, 0.0, 0.05))
    _plan(page)
    command(page)
    execute = page.get_by_role("button", name="Execute")
    wait_until(execute.is_enabled, "it can be executed")
    shown = "bioscara.preview === null ? 1 : bioscara.preview.time / Number(MAX)"
    shown = shown.replace("MAX", "document.querySelector('.view-plan input').max")
    assert page.evaluate(shown) == 1.0
    execute.click()
    wait_until(lambda: 0.2 < page.evaluate(shown) < 0.6, "it is followed")
    assert page.get_by_label("Time in the plan").is_disabled()
    # Where the arm is now; it moves on, by 1 mm in the 0.2 s between two looks.
    ghost, tool = _tool(page, "plannedRoom"), left.robot.pose
    assert ghost[:3] == pytest.approx(tool[:3], abs=5e-3)
    wait_until(lambda: page.evaluate(shown) > 0.6, "it goes on")
    page.locator(".view-plan").wait_for(state="hidden")


def test_a_plan_dies_when_the_arm_moves(page: Page, left: Site) -> None:
    _show_target(page, *_near(left.robot, 0.0, 0.0, -0.01))
    _plan(page)
    at = list(left.robot.state.positions)
    _move(left, [at[0] + 0.05, *at[1:]])
    status = page.locator("#plan-status")
    wait_until(lambda: "j1 is not where" in status.inner_text(), "the plan is void")
    _move(left, at)
    command(page)
    page.wait_for_timeout(200)
    assert "Void" in status.inner_text()
    assert page.get_by_role("button", name="Execute").is_disabled()


def test_a_plan_dies_when_the_workspace_changes(page: Page, left: Site) -> None:
    command(page)
    _show_target(page, *_near(left.robot, 0.0, 0.0, -0.01))
    _plan(page)
    execute = page.get_by_role("button", name="Execute")
    wait_until(execute.is_enabled, "it can be executed")
    page.evaluate("() => bioscara.start({kind: 'set_scene', scene: {margin: 0.006}})")
    wait_until(execute.is_disabled, "the plan is void")
    assert "tool, scene" in page.locator("#plan-status").inner_text()


def test_a_refused_plan_names_and_marks_what_would_collide(page: Page, left: Site) -> None:
    x, y, z, yaw = _near(left.robot, 0.0, 0.0, 0.0)
    left.robot.scene = Scene(
        zones=(Box("<b>rack", (x - 0.1, y - 0.1, 0), (x + 0.1, y + 0.1, z - 0.04)),)
    )
    left.robot.release_lease()
    _until(page, "bioscara.arm.workspace.scene.zones?.length === 1")
    _show_target(page, x, y, z - 0.05, yaw)
    page.get_by_role("button", name="Plan", exact=True).click()
    refusal = page.locator(".target-refusal")
    refusal.wait_for(state="visible")
    assert "Collision:" in refusal.inner_text()
    assert "<b>rack" in refusal.inner_text()
    assert page.locator(".view-plan").is_hidden()
    marked = "bioscara.view.picture.collision.includes('<b>rack')"
    _until(page, marked)


def test_the_target_is_dragged_and_nothing_moves(page: Page, left: Site) -> None:
    before = list(left.robot.state.positions)
    _show_target(page)
    _until(page, "bioscara.view.drawing.handle.group.visible")
    start = page.evaluate("() => bioscara.view.target.pose")
    x, y = page.evaluate(AT_HANDLE)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x - 20, y + 4)
    page.mouse.move(x - 40, y + 8)
    page.mouse.up()
    end = page.evaluate("() => bioscara.view.target.pose")
    assert np.hypot(end[0] - start[0], end[1] - start[1]) > 0.01
    assert end[2:] == pytest.approx(start[2:])
    page.mouse.move(x, y)
    assert page.evaluate("() => bioscara.view.target.pose") == end
    assert list(left.robot.state.positions) == pytest.approx(before, abs=1e-3)


def test_a_press_makes_pictures_rare_and_a_hidden_view_has_none(page: Page) -> None:
    count = """pressed => new Promise(resolve => {
      document.documentElement.dataset.pressed = pressed;
      if (!pressed) delete document.documentElement.dataset.pressed;
      const { scheduler } = bioscara.view;
      const before = scheduler.frames;
      const timer = setInterval(() => scheduler.request(), 10);
      setTimeout(() => { clearInterval(timer); resolve(scheduler.frames - before); }, 1000);
    })"""
    assert page.evaluate(count, "jog") <= 6
    # On a computer that draws slowly, pictures are rare anyway.
    assert page.evaluate(count, "") > 6 or page.evaluate("bioscara.view.scheduler.slow")
    page.evaluate("() => { document.getElementById('view').hidden = true; }")
    assert page.evaluate(count, "") <= 1
    page.evaluate("() => { document.getElementById('view').hidden = false; }")


def test_a_slow_view_has_half_the_resolution_and_says_so(page: Page) -> None:
    drawn = _frames(page)
    page.evaluate(
        """() => { const { scheduler } = bioscara.view;
          scheduler.slow = true; scheduler.becameSlow(); }"""
    )
    assert "slowly" in page.locator(".view-note").inner_text()
    wait_until(lambda: _frames(page) > drawn, "it is drawn")
    canvas = "bioscara.view.drawing.stage.canvas"
    assert page.evaluate(f"{canvas}.width / {canvas}.clientWidth") == pytest.approx(0.5, abs=0.01)


def test_without_webgl_the_arm_is_flat_and_has_the_same_target(
    browser: Browser, left: Site
) -> None:
    context = browser.new_context(viewport={"width": 1024, "height": 768})
    context.add_init_script(f"({NO_WEBGL})()")
    page = open_page(context, left)
    _drawn(page)
    assert "no WebGL" in page.locator(".view-note").inner_text()
    pose = left.robot.pose
    assert pose is not None
    drawn = page.evaluate(
        "() => document.querySelector('.view-flat .live .tool').getAttribute('points')"
    )
    assert [float(part) for part in drawn.split()[2].split(",")] == pytest.approx(
        [1e3 * pose.x, -1e3 * pose.y], abs=0.2
    )
    _show_target(page)
    page.get_by_role("button", name="more x", exact=True).click()
    handle = page.locator(".view-flat .target").first.bounding_box()
    assert handle
    page.mouse.move(handle["x"] + 8, handle["y"] + handle["height"] / 2)
    page.mouse.down()
    page.mouse.move(handle["x"] - 12, handle["y"] + handle["height"] / 2)
    page.mouse.up()
    assert page.evaluate("() => bioscara.view.target.pose[0]") < pose.x
    assert page.errors == []  # type: ignore[attr-defined]
    context.close()
