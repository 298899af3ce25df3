"""Replay: positions over time, with clearance, limits and the path of the tool."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

import numpy as np
import pytest

from bioscara.errors import BusUnavailableError, TrajectoryError
from bioscara.kinematics import Joints
from bioscara.model import load_parameters
from bioscara.planning import Trajectory
from bioscara.planning.collision.margins import GOAL_SLACK
from bioscara.planning.collision.scene import Box, Scene
from bioscara.planning.collision.shapes import Prism
from bioscara.robot import kinematics_of

pytest.importorskip("viser", reason="pip install 'bioscara[view]': the 3D page")

from bioscara.viewer import readouts
from bioscara.viewer.live import Live
from bioscara.viewer.page import Page
from bioscara.viewer.played_motion import PlayedMotion
from bioscara.viewer.player import SPEEDS, Player
from bioscara.viewer.zones import NEAREST
from viewer.browser import Browser, wait

PARAMETERS = load_parameters()
LIMITS = PARAMETERS.joints
ARM = kinematics_of(PARAMETERS)
NAMES = tuple(limit.name for limit in LIMITS)
SCENE = Scene((Box("reader", (0.3, -0.6, 0.0), (0.6, -0.4, 0.1)),), table_height=-0.05)
START, GOAL = (-0.2, 0.2, 0.6, 0.1), (-1.2, 0.1, 1.4, -0.6)
TRAJECTORY = Trajectory(NAMES, [0.0, 4.0], [START, GOAL], np.zeros((2, 4)))
RECORDING = PlayedMotion.of_trajectory("a motion", TRAJECTORY, NAMES, (0.0,) * 4)


@pytest.fixture(scope="module")
def page() -> Iterator[Page]:
    page = Page(0, SCENE, ARM, PARAMETERS)
    yield page
    page.close()


@pytest.fixture
def player(page: Page) -> Iterator[Player]:
    page.gui.reset()
    page._readouts = page.gui.add_html("")
    player = Player(page, RECORDING)
    player.step(100.0)
    return player


def test_a_recording_is_the_trajectory() -> None:
    for time in np.linspace(-0.5, 4.5, 37):
        expected = TRAJECTORY.sample(float(time)).positions
        assert RECORDING.at(float(time)) == pytest.approx(expected, abs=2e-5)


def test_joints_that_a_trajectory_does_not_name_stay_where_they_are() -> None:
    part = Trajectory(("j3",), [0.0, 1.0], [[0.1], [0.4]])
    recording = PlayedMotion.of_trajectory("part", part, NAMES, START)
    assert recording.at(0.5) == pytest.approx((START[0], START[1], 0.25, START[3]))
    with pytest.raises(TrajectoryError, match="j9 is not a joint of the arm; it has j1, j2"):
        PlayedMotion.of_trajectory("", Trajectory(("j9",), [0.0], [[0.0]]), NAMES, START)


@pytest.mark.parametrize("speed", SPEEDS)
def test_time_passes_at_the_chosen_speed(player: Player, page: Page, speed: str) -> None:
    player.speed.value = speed
    player.toggle()
    factor = float(speed.rstrip("x"))
    for elapsed in (0.05, 0.1, 0.3):
        player.step(100.0 + elapsed)
        assert player.time == pytest.approx(min(factor * elapsed, 4.0))
        assert page.joints() == pytest.approx(RECORDING.at(player.time))
        assert player.slider.value == pytest.approx(player.time, abs=0.006)


def test_without_play_time_stands_still(player: Player) -> None:
    player.step(105.0)
    assert player.time == 0.0
    player.toggle()
    player.step(106.0)
    player.toggle()
    player.step(107.0)
    assert (player.time, player.button.label) == (pytest.approx(1.0), "Play")


def test_it_stops_at_the_end_and_plays_again_from_the_start(player: Player, page: Page) -> None:
    player.toggle()
    player.step(150.0)
    assert (player.time, player.playing, player.button.label) == (4.0, False, "Play")
    assert page.joints() == pytest.approx(GOAL)
    player.toggle()
    player.step(151.0)
    player.step(151.5)
    assert (player.time, player.button.label) == (pytest.approx(0.5), "Pause")


@pytest.mark.parametrize(("to", "there"), [(1.5, 1.5), (-3.0, 0.0), (9.0, 4.0)])
def test_going_to_a_time_pauses(player: Player, page: Page, to: float, there: float) -> None:
    player.toggle()
    player.step(100.1)
    player.seek(to)
    for now in (100.2, 101.0):
        player.step(now)
        assert (player.time, player.playing) == (there, False)
        assert page.joints() == pytest.approx(RECORDING.at(there))


def test_the_slider_and_the_button_of_the_browser_do_the_same(player: Player, page: Page) -> None:
    browser = Browser(page)
    try:
        player.toggle()
        uuid = player.slider._impl.uuid
        browser.say(type="GuiUpdateMessage", uuid=uuid, updates={"value": 2.5})
        wait(lambda: player._wanted == 2.5)
        player.step(100.1)
        assert (player.time, player.playing) == (2.5, False)
        uuid = player.button._impl.uuid
        browser.say(type="GuiUpdateMessage", uuid=uuid, updates={"value": True})
        wait(lambda: player.playing)
    finally:
        browser.close()
    player.step(100.3)
    assert player.time == pytest.approx(2.7)


def test_the_path_of_the_tool_is_shown(player: Player, page: Page) -> None:
    points = page._server.scene._handle_from_node_name["/base_link/trace"].points
    assert np.array_equal(points[1:, 0], points[:-1, 1])
    for joints, point in ((START, points[0, 0]), (GOAL, points[-1, 1])):
        assert point == pytest.approx(ARM.forward(joints)[:3], abs=1e-6)
    assert player.time == 0.0


def test_the_least_clearance_of_the_motion_is_shown(player: Player, page: Page) -> None:
    heading = player._heading()
    found = re.search(r"least clearance (\S+) mm at (\S+) s \((.*) to (.*)\)", heading)
    assert found
    least = SCENE.clearance(ARM, RECORDING.positions).min()
    assert float(found[1]) == pytest.approx(1e3 * least, abs=0.06)
    pair = page.scene.nearest_pair(ARM, RECORDING.at(float(found[2])))
    assert pair is not None
    assert (pair.link, pair.other) == (found[3], found[4])


@pytest.mark.parametrize("seed", range(20))
def test_the_nearest_pair_has_the_clearance_of_the_scene(seed: int) -> None:
    rng = np.random.default_rng(seed)
    joints = rng.uniform([j.lower for j in LIMITS], [j.upper for j in LIMITS])
    pair = SCENE.nearest_pair(ARM, joints.tolist())
    assert pair is not None
    assert pair.distance == pytest.approx(float(SCENE.clearance(ARM, joints[None])[0]))
    assert pair.margin == SCENE.margin


def test_the_distance_of_a_load_to_what_it_may_touch_is_the_true_one() -> None:
    tool = ARM.tool
    load = Prism(tool.x, tool.y, 0.01, 0.01, tool.z - 0.05, tool.z)
    scene = Scene(table_height=0.0).carrying(load, ("table",))
    lift = 0.0505 - tool.z - ARM.geometry.height
    pair = scene.nearest_pair(ARM, Joints(0.0, lift, 0.8, 0.0))
    assert pair is not None
    if (pair.link, pair.other) == ("load", "table"):
        assert pair.distance == pytest.approx(0.5e-3)
        assert pair.margin == pytest.approx(-GOAL_SLACK)
    else:
        pytest.fail(str(pair))


def colors(page: Page) -> dict[str, object]:
    nodes = page._server.scene._handle_from_node_name
    shown = {name: nodes[f"/{name}/0"].color for name in ("link_1", "link_2", "grp_base_link")}
    return shown | {
        "jaws": nodes["/left_jaw_link/0"].color,
        "table": nodes["/base_link/table"].color,
        "tool": NEAREST if nodes["/tool/point"].visible else None,
        "reader": NEAREST if nodes["/base_link/zone_0/solid"].opacity > 0.5 else None,
    }


@pytest.mark.parametrize(
    ("joints", "expected"),
    [
        ((-3.04, 0.337, 2.62, 3.0), {"grp_base_link", "link_1"}),
        ((1.0, 0.0, 0.3, 0.0), {"jaws", "table"}),
        ((-0.8, 0.1, 0.0, 0.0), {"jaws", "reader"}),
        ((0.0, 0.2, 0.0, 0.0), {"jaws", "table"}),
    ],
)
def test_the_nearest_pair_alone_is_red(
    page: Page, joints: tuple[float, ...], expected: set[str]
) -> None:
    page.show(dict(zip(NAMES, joints, strict=True)))
    assert {name for name, color in colors(page).items() if color == NEAREST} == expected


def test_positions_are_shown_in_degrees_and_millimetres() -> None:
    angle, length = LIMITS[0], LIMITS[1]
    assert "45.0°" in readouts.joint_row(angle, math.pi / 4.0)
    assert "123.4 mm" in readouts.joint_row(length, 0.1234)
    assert "-0.0" not in readouts.joint_row(angle, -1e-9)


@pytest.mark.parametrize("limit", LIMITS, ids=lambda limit: limit.name)
def test_a_position_near_or_beyond_a_limit_has_a_warning_colour(limit: object) -> None:
    lower, upper = limit.lower, limit.upper  # type: ignore[attr-defined]
    span = upper - lower
    seen = []
    for share in (-0.01, 0.0, 0.04, 0.06, 0.5, 0.94, 0.96, 1.0, 1.01):
        row = readouts.joint_row(limit, lower + share * span)  # type: ignore[arg-type]
        colour = re.search(r"text-align:right;color:(#\w+)", row)
        bar = re.search(r"left:calc\(([\d.]+)%", row)
        assert colour
        assert bar
        assert float(bar[1]) == pytest.approx(100.0 * min(max(share, 0.0), 1.0), abs=0.01)
        seen.append(colour[1])
    free, near, beyond = seen[4], seen[2], seen[0]
    assert len({free, near, beyond}) == 3
    assert seen == [beyond, near, near, free, free, free, near, near, beyond]


class Arm:
    """A running simulated arm: its answers to LOOK, in order."""

    def __init__(self, *answers: tuple[float, tuple[float, ...]] | None) -> None:
        self.answers = list(answers)

    def look(self) -> tuple[float, tuple[float, ...]]:
        answer = self.answers.pop(0)
        if answer is None:
            raise BusUnavailableError("no simulated arm behind it")
        return answer


def test_a_live_arm_is_shown_where_it_is_and_waited_for(page: Page) -> None:
    page.gui.reset()
    page._readouts = page.gui.add_html("")
    live = Live(page, "sim:/a.sock", Arm((1.0, START), (2.0, GOAL), None, (0.1, START)).look)
    live.step(10.0)
    assert page.joints() == START
    live.step(10.1)
    assert page.joints() == GOAL
    assert len(live._trace) == 2
    live.step(10.2)
    assert "no simulated arm behind it" in live._status.content
    live.step(11.0)  # not yet: a missing arm is looked for once a second
    assert page.joints() == GOAL
    live.step(11.3)
    assert page.joints() == START
    assert "no simulated arm" not in live._status.content
    assert len(live._trace) == 1, "the path of the arm before the restart"
