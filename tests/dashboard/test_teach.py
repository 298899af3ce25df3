"""Poses, frames and sequences in the browser: the arm's table changes, and the arm moves."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Dialog, Locator, Page

from bioscara import Frame, Joints, NamedPose, Pose
from bioscara.robot.sequences.script import to_script
from bioscara.robot.sequences.sequence_file import read_sequence, text_of_sequence
from dashboard.rig import Site, at_rest, command, page_of, positions, stays, upload, wait_for_state
from programs import wait_until
from robot.sequences.samples import EACH_KIND
from served import HALF

pytestmark = pytest.mark.browser

NEAR = Joints(0.4, 0.2, 0.8, -0.5)
"""A tenth of a radian from where the arm stands."""
FILE = """\
schema: 1
title: to and fro <b>
tool: fingers
steps:
- {kind: move_named, name: near, velocity_scaling: 0.9}
- {kind: wait, seconds: 0.2}
- kind: move_joints
  positions: {j1: 0.3, j2: 0.2, j3: 0.8, j4: -0.5}
...
"""


@pytest.fixture(scope="module")
def teach(browser: Browser, left: Site) -> Iterator[Page]:
    """Return the panel in a page that commands the arm."""
    with page_of(browser, left, clean=False, accept_downloads=True) as page:
        page.on("dialog", _refuse)
        page.get_by_role("tab", name="Teach").click()
        command(page)
        yield page


def _refuse(dialog: Dialog) -> None:
    raise AssertionError(f"the page opened a dialog of the browser: {dialog.message}")


@pytest.fixture
def panel(teach: Page, left: Site) -> Iterator[Page]:
    """Return the panel with the table and without steps, and the arm at its place."""
    wait_until(lambda: at_rest(left.robot), "the arm rests")
    set_table(teach, left, NamedPose("near", NEAR, None), NamedPose("far", Joints(*HALF), None))
    while teach.get_by_role("button", name="Remove step 1", exact=True).count():
        teach.get_by_role("button", name="Remove step 1", exact=True).click()
    teach.locator("#pose-search").fill("")
    yield teach
    assert teach.errors == []  # type: ignore[attr-defined]


def holds(page: Page, condition: str) -> None:
    """Wait for a condition in the page, whose policy forbids Playwright to do so there."""
    wait_until(lambda: page.evaluate(condition), condition)


def set_table(page: Page, made: Site, *poses: NamedPose, frames: tuple[Frame, ...] = ()) -> None:
    """Give the arm another table, by another client, and wait until the page has it."""
    if page.evaluate("bioscara.arm.epoch") is not None:
        page.get_by_role("button", name="Give back").click()
        wait_until(lambda: page.evaluate("bioscara.arm.lease.client") is None, "it is given back")
    made.robot.table = replace(made.robot.table, poses=poses, frames=frames)
    made.robot.release_lease()
    page.locator("#lease-take").click()
    wait_for_state(page, "commanding")
    holds(page, f"bioscara.arm.workspace.table.poses?.length === {len(poses)}")


def names(made: Site) -> list[str]:
    return [pose.name for pose in made.robot.table.poses]


def load(page: Page, text: str) -> None:
    upload(page, ".yaml,.yml", "a.yaml", text)


def test_a_pose_is_saved_overwritten_renamed_and_deleted_with_undo(panel: Page, left: Site) -> None:
    panel.locator("#pose-name").fill("here")
    panel.get_by_role("button", name="Save here").click()
    panel.get_by_text("here was saved.").wait_for()
    saved = left.robot.table.pose("here")
    assert saved.joints == pytest.approx(HALF, abs=1e-3)
    assert saved.pose_tool_in_base == pytest.approx(left.robot.pose, abs=1e-3)

    panel.locator("#pose-name").fill("near")
    panel.get_by_role("button", name="Save here").click()
    dialog = panel.get_by_role("dialog", name="Overwrite near?")
    row = dialog.get_by_role("row", name="j1")
    assert row.get_by_role("cell").all_inner_texts() == ["22.92°", "17.19°", "-5.73°"]
    assert left.robot.table.pose("near").joints == NEAR
    dialog.get_by_role("button", name="Overwrite").click()
    wait_until(lambda: left.robot.table.pose("near").joints != NEAR, "near is overwritten")
    assert names(left) == ["near", "far", "here"]

    panel.get_by_role("option", name="here").click()
    panel.get_by_role("button", name="Rename", exact=True).click()
    panel.get_by_role("dialog").get_by_label("Name").fill("there")
    panel.keyboard.press("Enter")
    wait_until(lambda: names(left) == ["near", "far", "there"], "it is renamed")

    panel.get_by_role("option", name="there").click()
    panel.get_by_role("button", name="Delete", exact=True).click()
    wait_until(lambda: names(left) == ["near", "far"], "it is deleted")
    panel.locator(".undo-line").get_by_role("button", name="Undo").first.click()
    wait_until(lambda: names(left) == ["near", "far", "there"], "it is back")


def test_a_client_that_was_faster_is_named_and_nothing_is_lost(panel: Page, left: Site) -> None:
    # The page has not heard yet that the table has changed.
    panel.evaluate("bioscara.arm.workspace.revision -= 1")
    panel.locator("#pose-name").fill("late")
    panel.get_by_role("button", name="Save here").click()
    panel.get_by_text("changed the table first, and your change was not made").first.wait_for()
    assert "late" not in names(left)
    panel.get_by_role("button", name="Save here").click()
    wait_until(lambda: "late" in names(left), "the change is repeated")


def test_a_thousand_poses_are_searched_with_a_few_rows(panel: Page, left: Site) -> None:
    poses = [NamedPose(f"well_{i:04}", NEAR, None) for i in range(1000)]
    set_table(panel, left, *poses)
    assert panel.locator(".pose-row").count() < 40
    panel.locator("#pose-search").fill("0999")
    panel.get_by_text("1 of 1000").wait_for()
    panel.get_by_role("option", name="well_0999").click()
    panel.locator("#pose-search").fill("")
    panel.get_by_text("1000 of 1000").wait_for()
    listbox = panel.get_by_role("listbox", name="Named poses")
    listbox.focus()
    panel.keyboard.press("Home")
    panel.keyboard.press("End")
    assert panel.locator(".pose-title").inner_text() == "well_0999"
    assert panel.get_by_role("option", name="well_0999").get_attribute("aria-posinset") == "1000"


def test_frames_are_saved_at_the_tool_and_deleted_with_undo(panel: Page, left: Site) -> None:
    panel.locator("#frame-name").fill("bench")
    panel.get_by_role("button", name="Save frame at the tool").click()
    wait_until(lambda: [each.name for each in left.robot.frames] == ["bench"], "it is saved")
    assert left.robot.frame("bench").pose_frame_in_base == pytest.approx(left.robot.pose, abs=1e-3)
    panel.get_by_role("button", name="Delete bench").click()
    wait_until(lambda: left.robot.frames == (), "it is deleted")


@pytest.mark.path
def test_a_sequence_is_loaded_planned_carried_out_and_saved(
    panel: Page, left: Site, tmp_path: Path
) -> None:
    load(panel, FILE)
    panel.get_by_text("a.yaml: 3 steps.").wait_for()
    assert panel.locator("#sequence-title").input_value() == "to and fro <b>"
    panel.get_by_role("button", name="Dry run").click()
    panel.get_by_text("All steps can be carried out").wait_for()
    assert positions(left.robot) == pytest.approx(HALF, abs=2e-3)
    panel.get_by_role("button", name="Preview").last.click()
    holds(panel, "bioscara.preview?.title === 'to and fro <b>'")
    panel.get_by_role("button", name="Run all").click()
    panel.locator("[data-index='0'] .step-mark", has_text="done").wait_for()
    assert positions(left.robot)[0] > 0.35
    panel.get_by_text("All steps are done.").wait_for()
    stays(left.robot)
    assert positions(left.robot) == pytest.approx(HALF, abs=2e-3)

    with panel.expect_download() as download:
        panel.get_by_role("button", name="Save as YAML").click()
    path = tmp_path / "saved.yaml"
    download.value.save_as(path)
    assert [step.kind for step in read_sequence(path).steps] == [
        "move_named",
        "wait",
        "move_joints",
    ]
    with panel.expect_download() as download:
        panel.get_by_role("button", name="Save as Python").click()
    assert download.value.suggested_filename.endswith(".py")
    download.value.save_as(path)
    assert 'robot.move_named("near", velocity_scaling=0.9)' in path.read_text()


def test_steps_are_copied_as_the_program_that_does_the_same(panel: Page) -> None:
    sequence = EACH_KIND
    load(panel, text_of_sequence(sequence))
    panel.get_by_text(f"a.yaml: {len(sequence.steps)} steps.").wait_for()
    panel.context.grant_permissions(["clipboard-read", "clipboard-write"])

    def copied(button: Locator) -> object:
        button.click()
        button.get_by_text("Copied").wait_for()
        return panel.evaluate("navigator.clipboard.readText()")

    editor = panel.get_by_role("group", name="Sequence")
    assert copied(editor.locator(":scope > .row > .copy-python")) == to_script(sequence)
    # A step alone rests at its end, as when it is carried out alone.
    assert sequence.steps[2].blend > 0.0
    assert copied(panel.locator("[data-index='2'] .copy-python")) == to_script(sequence, 2, 3)


def test_a_refused_step_is_named_and_nothing_moves(panel: Page, left: Site) -> None:
    load(panel, FILE.replace("j1: 0.3", "j1: 9"))
    panel.locator("#messages").get_by_text("steps[2].positions.j1: 9 rad is outside").wait_for()
    load(panel, FILE.replace("name: near", "name: nowhere"))
    panel.get_by_role("button", name="Run all").click()
    panel.locator(".run-state", has_text="there is no pose 'nowhere'").wait_for()
    assert panel.locator("[data-index='0'] .step-mark").inner_text() == "refused"
    stays(left.robot)


def test_steps_are_added_edited_and_moved_by_keyboard(panel: Page, left: Site) -> None:
    for kind in ("move_linear", "wait"):
        panel.select_option("#step-kind", kind)
        panel.get_by_role("button", name="Add", exact=True).focus()
        panel.keyboard.press("Enter")
    panel.locator(".step-fields").get_by_label("Time").fill("0.5")
    panel.keyboard.press("Tab")
    assert "500 ms" in panel.locator("[data-index='1'] .step-words").inner_text()
    panel.get_by_role("button", name="Move up step 2").focus()
    panel.keyboard.press("Enter")
    words = panel.locator(".step-words").all_inner_texts()
    assert [each.split(" · ")[0] for each in words] == ["Wait", "Line to a pose"]
    # The focus has followed the step.
    assert panel.evaluate("document.activeElement.closest('li').dataset.index") == "0"
    panel.get_by_role("button", name="Undo").last.click()
    words = panel.locator(".step-words").all_inner_texts()
    assert words[0].startswith("Line to a pose")


def take(panel: Page, left: Site, label: str, j1: float) -> Pose:
    """Let the page move the arm, and take a point there; returns where the tool is."""
    panel.evaluate(
        "(goal) => bioscara.start({kind: 'move_joints', positions: goal})"
        ".then(({goal}) => bioscara.ended(goal))",
        [j1, *HALF[1:]],
    )
    wait_until(lambda: at_rest(left.robot), "the arm rests")
    holds(panel, f"Math.abs(bioscara.arm.sample.positions[0] - {j1}) < 1e-3")
    panel.get_by_role("button", name=label).click()
    pose: Pose = left.robot.pose
    return pose


def test_a_frame_is_taught_by_two_points_shown_before_it_is_saved(panel: Page, left: Site) -> None:
    part = panel.get_by_role("region", name="Frame by two points")
    panel.locator("#frame-name").fill("bench")
    save = part.get_by_role("button", name="Save frame of both points")
    assert save.get_attribute("title") == "take both points first"
    origin = take(panel, left, "Take the origin here", HALF[0])
    near = take(panel, left, "Take a point on x here", HALF[0] + 0.01)
    words = part.locator(".frame-found").inner_text()
    found = re.fullmatch(
        r"The points are (\d+\.\d) mm apart, too near for a direction: take points at least 20 mm "
        r"apart\.",
        words,
    )
    assert found, words
    distance = 1e3 * math.hypot(near.x - origin.x, near.y - origin.y)
    # The arm, which holds its position, is measured anew for each of both.
    assert float(found[1]) == pytest.approx(distance, abs=0.3)
    save.click(force=True)
    panel.locator("#messages .error", has_text="too near for a direction").wait_for()
    assert left.robot.frames == ()

    on_x = take(panel, left, "Take a point on x here", HALF[0] + 0.2)
    expected = Frame.from_points("bench", origin, on_x)
    words = part.locator(".frame-found").inner_text()
    x, y, z, yaw = expected.pose_frame_in_base
    distance = 1e3 * math.hypot(on_x.x - origin.x, on_x.y - origin.y)
    numbers = [float(each) for each in re.findall(r"-?\d+\.\d", words)]
    assert numbers[:5] == pytest.approx(
        [1e3 * x, 1e3 * y, 1e3 * z, math.degrees(yaw), distance], abs=0.2
    )
    save.click()
    wait_until(lambda: [each.name for each in left.robot.frames] == ["bench"], "it is saved")
    saved = left.robot.frame("bench")
    assert saved.pose_frame_in_base == pytest.approx(expected.pose_frame_in_base, abs=1e-3)

    # The code that is copied makes the same frame.
    code = save.evaluate("(button) => button.nextElementSibling.python()")
    assert code.splitlines()[-1].startswith(
        'robot.table = robot.table.with_frame(Frame.from_points("bench", Pose('
    )
    points = re.findall(r"Pose\(([^)]*)\)", code)
    made = Frame.from_points("bench", *(Pose(*map(float, point.split(", "))) for point in points))
    assert made.pose_frame_in_base == pytest.approx(saved.pose_frame_in_base, abs=1e-4)
    panel.locator(".undo-line").get_by_role("button", name="Undo").last.click()
    wait_until(lambda: left.robot.frames == (), "it is gone")
    take(panel, left, "Take the origin here", HALF[0])


def test_a_place_stays_where_it_is_in_another_frame(panel: Page, left: Site) -> None:
    bench = Frame("bench", Pose(0.2, 0.1, 0.05, 0.5))
    set_table(panel, left, NamedPose("near", NEAR, None), frames=(bench,))
    panel.select_option("#step-kind", "move_linear")
    panel.get_by_role("button", name="Add", exact=True).click()
    panel.locator(".step-fields").get_by_label("In frame").select_option("bench")
    values = panel.evaluate(
        "fetch('api/sequences/plan', {method: 'POST', body: JSON.stringify({steps: ["
        "{kind: 'move_named', name: 'near'}]})}).then((a) => a.json())"
    )["result"]
    assert values["verdicts"][0]["failure"] is None
    shown = panel.locator(".step-words").inner_text()
    assert shown.endswith("in bench")
    x, y, z = (float(each) / 1e3 for each in shown.split(" · ")[1].split(" ")[:3])
    place = bench.pose(x, y, z)
    assert place[:3] == pytest.approx(left.robot.pose[:3], abs=2e-4)


def test_pause_cancel_and_stop_end_a_sequence_at_rest(panel: Page, left: Site) -> None:
    load(panel, FILE.replace("speed: 0.9", "speed: 0.05"))
    panel.get_by_text("a.yaml: 3 steps.").first.wait_for()
    for way in ("Cancel the sequence", "STOP"):
        panel.get_by_role("button", name="Run all").click()
        wait_until(lambda: not at_rest(left.robot), "the arm moves")
        panel.locator(".run-pause").get_by_role("button", name="Pause").click()
        holds(panel, "bioscara.arm.sample.paused")
        panel.locator(".run-pause").get_by_role("button", name="Resume").click()
        holds(panel, "!bioscara.arm.sample.paused")
        panel.get_by_role("button", name=way).first.click()
        panel.locator(".run-state", has_text="was").wait_for()
        panel.get_by_role("button", name="Run all").wait_for()
        stays(left.robot)
    assert panel.locator("[data-index='1'] .step-mark").inner_text() != "done"
    wait_until(lambda: at_rest(left.robot), "the arm rests")


def test_a_sequence_ends_when_the_page_loses_control(panel: Page, left: Site) -> None:
    load(panel, FILE.replace("seconds: 0.2", "seconds: 30").replace("name: near", "name: far"))
    panel.get_by_text("a.yaml: 3 steps.").first.wait_for()
    panel.get_by_role("button", name="Run all").click()
    panel.locator("[data-index='1'] .step-mark", has_text="runs").wait_for()
    left.robot.acquire_lease(force=True)
    left.robot.release_lease()
    panel.locator(".run-state", has_text="does not command the arm any more").wait_for()
    stays(left.robot)
