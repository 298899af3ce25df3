"""The arm is enabled, homed and sent to poses from the page; each control has its Python."""

from __future__ import annotations

import ast
import builtins
from collections.abc import Iterator
from importlib import import_module

import pytest
from playwright.sync_api import Browser, Locator, Page

from bioscara import Load, Prism, RemoteRobot, Robot
from bioscara.api import messages as m
from bioscara.robot.robot_gripper import RobotGripper
from bioscara.robot.tasks.scope import Scope
from dashboard.rig import Site, at_rest, command, moves, page_of, positions, wait_for_state
from programs import wait_until
from served import HALF, RawClient

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def shared(browser: Browser, left: Site) -> Iterator[Page]:
    """Return a page that the tests share."""
    with page_of(browser, left, clean=False) as opened:
        yield opened


@pytest.fixture
def page(shared: Page, left: Site) -> Page:
    """Return the page, which commands the arm."""
    wait_until(lambda: at_rest(left.robot), "the arm rests")
    if shared.locator("html").get_attribute("data-state") != "commanding":
        command(shared)
    return shared


def part(page: Page, name: str) -> Locator:
    """Return a part of the panel."""
    return page.get_by_role("region", name=name)


def rests(left: Site) -> None:
    wait_until(lambda: at_rest(left.robot), "the motion ends", 20.0)


def test_the_arm_goes_to_a_pose_that_is_typed_in_after_a_preview(page: Page, left: Site) -> None:
    go = part(page, "Go to a pose")
    go.get_by_role("button", name="Fill in").click()
    z = left.robot.pose.z
    go.locator("#go-z").fill(f"{1000 * z + 8:.1f}")
    go.locator("#go-kind").select_option("move_linear")
    go.get_by_role("button", name="Preview", exact=True).click()
    go.get_by_text("The plan takes").wait_for()
    assert page.evaluate("bioscara.preview.trajectory.times.length") > 2
    moves(left.robot, lambda: go.get_by_role("button", name="Execute the preview").click())
    rests(left)
    assert left.robot.pose.z == pytest.approx(z + 0.008, abs=5e-4)
    page.evaluate("bioscara.showPreview(null)")
    assert go.get_by_role("button", name="Execute the preview").is_hidden()
    go.locator("#go-x").fill("")
    # A button that is refused can be pressed nevertheless.
    go.get_by_role("button", name="Go", exact=True).press("Enter")
    page.get_by_text("a field is empty").first.wait_for()
    go.get_by_role("button", name="Fill in").click()


MOUNTED = """async (age) => {
    Object.defineProperty(bioscara.arm, "arrival", {
        get: () => performance.now() - age, set() {}, configurable: true,
    });
    const { goToCard } = await import("/js/run/go_to.js");
    window.made = goToCard(bioscara);
    const { cycle } = bioscara.arm.sample;
    const pause = () => new Promise((done) => setTimeout(done, 20));
    while (bioscara.arm.sample.cycle < cycle + 20) await pause();
}"""
"""Builds the part in a page whose values are as old as given [ms], and waits for further ones."""


def test_the_fields_of_a_pose_are_filled_in_once_by_values_that_are_not_old(page: Page) -> None:
    page.evaluate("document.getElementById('messages').replaceChildren()")
    try:
        page.evaluate(MOUNTED, 500)
        # The page fills them in unasked: without values it is silent.
        assert page.locator("#messages").inner_text() == ""
    finally:
        page.evaluate(
            "() => { delete bioscara.arm.arrival; bioscara.arm.arrival = performance.now(); }"
        )
    wait_until(
        lambda: page.evaluate("made.querySelector('#go-x').value") != "", "the fields are filled"
    )


@pytest.mark.path
def test_a_named_pose_is_reached_and_cancelled(page: Page, left: Site) -> None:
    named = part(page, "Named poses")
    moves(left.robot, lambda: named.get_by_role("button", name="Go", exact=True).click())
    goal = part(page, "Motion")
    goal.get_by_role("button", name="Cancel move_named()").click()
    rests(left)
    goal.get_by_text("cancelled").first.wait_for()
    assert abs(left.robot.state.positions[0]) > 0.01


def test_motion_is_paused_and_resumed(page: Page, left: Site) -> None:
    motion = part(page, "Motion")
    goal = positions(left.robot)[0] + (0.2 if positions(left.robot)[0] < HALF[0] else -0.2)
    moves(left.robot, lambda: page.evaluate("""(goal) => bioscara.start({
        kind: "move_joints", positions: goal, velocity_scaling: 0.3,
    })""", [goal, *HALF[1:]]))  # fmt: skip
    motion.get_by_role("button", name="Pause", exact=True).click()
    wait_until(lambda: max(map(abs, left.robot.state.velocities)) < 1e-3, "the arm rests")
    assert not at_rest(left.robot)
    motion.get_by_role("button", name="Resume", exact=True).click()
    rests(left)
    assert positions(left.robot)[0] == pytest.approx(goal, abs=2e-3)


def test_several_clients_pause_and_each_lifts_its_own_pause(page: Page, left: Site) -> None:
    motion = part(page, "Motion")
    pause = motion.get_by_role("button", name="Pause", exact=True)
    resume = motion.get_by_role("button", name="Resume", exact=True)
    page.evaluate("bioscara.arm.release()")
    with RawClient("anna") as anna, RawClient("bench-script") as script:

        def authors() -> list[str]:
            return [name.partition(" ")[0] for name in anna.request(m.GetState()).paused_by]

        anna.request(m.Pause())
        motion.get_by_text("Paused by anna.", exact=True).wait_for()
        page.locator(".condition", has_text="paused by anna").wait_for()
        pause.click()
        wait_until(lambda: authors() == ["anna", "dashboard"], "the page has paused, too")
        resume.click()
        wait_until(lambda: authors() == ["anna"], "its own pause is lifted")
        epoch = script.acquire()
        resume.click()
        page.get_by_text(
            "paused by 'anna'; anna or the holder of the lease, 'bench-script', can resume"
        ).wait_for()
        anna.request(m.Resume())
        resume.wait_for(state="hidden")
        script.request(m.ReleaseLease(), epoch)


def test_a_page_that_may_only_look_pauses_and_does_not_resume(browser: Browser, left: Site) -> None:
    with page_of(browser, left, Scope.VIEW, clean=False) as page:
        motion = part(page, "Motion")
        motion.get_by_role("button", name="Pause", exact=True).click()
        motion.get_by_role("button", name="Resume", exact=True).press("Enter")
        page.get_by_text("Resume: this page is signed in to look").wait_for()
    with RawClient("bench-script") as script:
        (author,) = script.request(m.GetState()).paused_by
        assert author.startswith("dashboard (view, ")
        epoch = script.acquire()
        script.request(m.Resume())
        script.request(m.ReleaseLease(), epoch)


def test_the_speed_is_overridden_and_its_reduction_released_in_two_presses(
    page: Page, left: Site
) -> None:
    speed = part(page, "Speed")
    slider = speed.locator("#override")
    slider.focus()
    for _ in range(3):
        page.keyboard.press("ArrowLeft")
    wait_until(lambda: left.robot.speed_override == pytest.approx(0.97), "the speed is set")
    slider.fill("100")
    wait_until(lambda: left.robot.speed_override == 1.0, "the speed is set")
    speed.get_by_role("button", name="Release the reduced speed", exact=True).click()
    assert left.robot.reduced_speed
    assert "nobody is within its reach" in speed.inner_text()
    speed.get_by_role("button", name="Release the reduced speed now").click()
    wait_until(lambda: not left.robot.reduced_speed, "the speed is released")
    speed.get_by_role("button", name="Reduce the speed").click()
    wait_until(lambda: left.robot.reduced_speed, "the speed is reduced")


def test_the_gripper_moves_to_a_width(page: Page, left: Site) -> None:
    gripper = part(page, "Gripper")
    if not gripper.get_by_role("button", name="Switch the servo off").is_visible():
        gripper.get_by_role("button", name="Enable").click()
    wait_until(lambda: left.robot.gripper.width == left.robot.gripper.width, "it is driven")
    gripper.locator("#gripper-width").fill("45")
    gripper.get_by_role("button", name="Move the jaws").click()
    wait_until(lambda: abs(left.robot.gripper.width - 0.045) < 1e-6, "the jaws move")
    rests(left)


def test_a_load_is_grasped_with_its_size_and_released(page: Page, left: Site) -> None:
    gripper = part(page, "Gripper")
    gripper.get_by_role("button", name="Open", exact=True).click()
    wait_until(lambda: left.robot.gripper.width > 0.05, "the jaws are open")
    rests(left)
    gripper.locator("summary").click()
    # The fields begin with a microplate, for which the jaws are wide enough.
    grasp = gripper.get_by_role("button", name="Grasp", exact=True)
    grasp.click()
    gripper.get_by_text("carries plate").wait_for()
    rests(left)
    gripper.get_by_role("button", name="Release", exact=True).click()
    gripper.get_by_text("carries nothing").wait_for()
    rests(left)
    fields = {"Name": "vial_1", "Length": "30", "Between the jaws": "60", "Below the tool's point":
              "25", "Above the tool's point": "10", "Mass": "12"}  # fmt: skip
    for label, value in fields.items():
        gripper.get_by_label(label).fill(value)
    grasp.click()
    gripper.get_by_text("carries vial_1").wait_for()
    rests(left)
    load = left.robot.load
    assert load is not None
    shape = Prism.between((-0.015, -0.03, -0.025), (0.015, 0.03, 0.01))
    # It touches no table where there is none.
    assert load == Load("vial_1", shape, mass=0.012)
    assert left.robot.gripper.width < 0.06
    code = grasp.evaluate("(button) => button.nextElementSibling.python()")
    check(code)
    assert code.splitlines()[-1] == (
        'robot.gripper.grasp(Load("vial_1", Prism.between((-0.015, -0.03, -0.025), '
        "(0.015, 0.03, 0.01)), mass=0.012))"
    )
    gripper.get_by_role("button", name="Release", exact=True).click()
    gripper.get_by_text("carries nothing").wait_for()
    rests(left)
    assert left.robot.load is None
    assert left.robot.gripper.width > 0.06


def test_disabling_says_what_it_means_and_one_joint_is_homed_alone(page: Page, left: Site) -> None:
    power = part(page, "Power and homing")
    power.get_by_role("button", name="Disable", exact=True).click()
    assert "may sink" in power.inner_text()
    power.get_by_role("button", name="Disable now").click()
    wait_until(lambda: not left.robot.is_enabled, "the joints are disabled")
    rests(left)
    power.get_by_role("button", name="Enable", exact=True).click()
    wait_until(lambda: left.robot.is_enabled, "the joints are enabled")
    rests(left)
    # The lift is not at its end stop: the wrist may not be homed alone, and the page says why.
    power.get_by_role("button", name="Home j4").click()
    page.get_by_text("j4 cannot be homed").first.wait_for()
    rests(left)
    power.get_by_role("button", name="Home j2").click()
    wait_until(lambda: left.robot.is_moving, "it homes")
    part(page, "Motion").get_by_role("button", name="Cancel home()").click()
    rests(left)
    power.get_by_text("not homed").first.wait_for()


def test_the_python_of_each_control_can_be_run(page: Page) -> None:
    wait_for_state(page, "commanding")
    page.evaluate("document.querySelectorAll('details').forEach((each) => { each.open = true; })")
    codes = page.evaluate(
        """() => Promise.allSettled(
            Array.from(document.querySelectorAll('.copy-python'), (each) => each.python())
        ).then((all) => all.map(({value, reason}) => value ?? reason.message))"""
    )
    for mode in ("tool", "joints"):
        for size in ("10", "0"):
            page.evaluate(
                """([mode, size]) => {
                    document.querySelector(`[data-value="${mode}"]`).click();
                    document.querySelector(`.choice [data-value="${size}"]`).click();
                }""",
                [mode, size],
            )
            codes.append(page.evaluate("document.querySelector('.jog-card .copy-python').python()"))
    assert len(codes) > 20
    for code in codes:
        # The sequence of the page has no steps.
        if code != "steps: there is none; a sequence has at least one step":
            check(code)


def check(code: str) -> None:
    """Require that code compiles, and that it names only what there is."""
    tree = ast.parse(code)
    compile(tree, "<copied>", "exec")
    kinds = {"robot": (Robot, RemoteRobot), "robot.gripper": (RobotGripper,)}
    imported = set()
    for node in ast.walk(tree):
        match node:
            case ast.ImportFrom(module=str(module), names=names):
                assert all(hasattr(import_module(module), each.name) for each in names), code
                imported |= {each.asname or each.name for each in names}
            case ast.Import(names=names):
                imported |= {each.asname or each.name for each in names if import_module(each.name)}
            case ast.Attribute(value=value, attr=attribute) if attribute != "gripper":
                parts = kinds.get(ast.unparse(value), ())
                assert not parts or any(hasattr(kind, attribute) for kind in parts), code
    used = [each for each in ast.walk(tree) if isinstance(each, ast.Name)]
    stored = {each.id for each in used if isinstance(each.ctx, ast.Store)}
    assert {each.id for each in used} <= {"robot", *stored, *imported, *dir(builtins)}, code
