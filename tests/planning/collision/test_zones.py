"""Zones keep the arm out along its whole path, and report by how much it is too near."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from bioscara.errors import ConfigurationError, InvalidArgumentError, TrajectoryError, ZoneError
from bioscara.kinematics import Joints
from bioscara.planning import point_to_point
from bioscara.planning.collision.arm_bodies import GRIPPER
from bioscara.planning.collision.margins import GOAL_SLACK, OWN_MARGIN
from bioscara.planning.collision.scene import Box, Cylinder, Scene
from bioscara.planning.collision.scene_pairs import LINKS
from bioscara.planning.collision.shapes import Prism
from bioscara.planning.files.scene_file import read_scene, save_scene
from bioscara.planning.trajectory.trajectory import Trajectory
from laws import examples
from planning.limits import LIMITS, NAMES
from planning.sampled_contact import beyond, points_of, touched
from planning.scenes import ARM, COUNT, free_joints, random_joints, random_scene

SEEDS = st.integers(0, 2**32 - 1)
REST = Joints(0.0, 0.2, 0.0, 0.0)


@given(SEEDS)
@settings(max_examples=examples(15))
def test_clearance_is_the_distance_of_the_nearest_point(seed: int) -> None:
    rng = np.random.default_rng(seed)
    joints = random_joints(rng)
    bodies = list(points_of(ARM, joints))
    for zone in random_scene(rng).zones:
        if zone.keep_in:
            continue
        for link in LINKS[:-1]:
            nearest = min(float(beyond(zone, p).min()) for name, p in bodies if name == link)
            alone = Scene((replace(zone, links=(link,)),))
            pairs = alone.layout(ARM)
            rows = [number for number, pair in enumerate(pairs.pairs) if pair.zone == zone.name]
            clearance = float(pairs.clearances(ARM, np.array([joints]))[rows].min())
            assert clearance <= max(nearest, 0.0) + 1e-9
            if clearance > 0.0:
                # The points are at most 5 cm from any of the body.
                assert nearest <= clearance + 0.05


@given(SEEDS, st.floats(0.01, 0.3), st.floats(-math.pi, math.pi))
def test_clearance_is_the_distance_to_a_thin_pole(
    seed: int, distance: float, bearing: float
) -> None:
    """A pole at known distances from the outermost point of the tool."""
    rng = np.random.default_rng(seed)
    joints = random_joints(rng)
    pose = ARM.forward(joints)
    x, y = pose.x + distance * math.cos(bearing), pose.y + distance * math.sin(bearing)
    pole = Cylinder("pole", x, y, 1e-3, pose.z - 0.01, pose.z + 0.01, links=("tool",))
    scene = Scene((pole,), mounted=())
    assert scene.clearance(ARM, [joints])[0] == pytest.approx(distance - 1e-3, abs=1e-9)


@given(SEEDS)
def test_clearance_changes_no_faster_than_the_arm_moves(seed: int) -> None:
    rng = np.random.default_rng(seed)
    scene = random_scene(rng)
    here = np.array([random_joints(rng) for _ in range(20)])
    there = here + rng.normal(size=here.shape) * rng.choice([1e-4, 1e-2, 0.2], size=(20, 1))
    way = np.abs(there - here) @ scene.layout(ARM).reach
    change = np.abs(scene.clearance(ARM, there) - scene.clearance(ARM, here))
    assert (change <= way + 1e-12).all()


def refusal(scene: Scene, move: Trajectory) -> ZoneError | None:
    try:
        scene.check(ARM, move)
    except ZoneError as error:
        return error
    return None


def test_no_sample_of_a_random_move_enters_a_zone() -> None:
    rng = np.random.default_rng(4)
    tried = accepted = refused = 0
    while tried < COUNT:
        scene = random_scene(rng)
        start, goal = free_joints(rng, scene), free_joints(rng, scene)
        if start is None or goal is None:
            continue
        tried += 1
        move = point_to_point(NAMES, start, goal, LIMITS)
        instants = np.linspace(0.0, move.duration, max(int(move.duration / 4e-3), 200))
        positions = move.sample_many(instants)[0]
        least = scene.clearance(ARM, positions).min()
        error = refusal(scene, move)
        if error is not None:
            refused += 1
            # It does come too near, at the reported time and depth.
            around = move.sample_many(np.linspace(error.time - 1e-6, error.time + 1e-6, 3))[0]
            assert scene.clearance(ARM, around).min() < scene.margin
            assert 0.0 < error.depth < scene.margin - least + 0.02
            continue
        accepted += 1
        assert least >= scene.margin - 4e-4
        for row in positions[:: max(len(positions) // 3, 1)]:
            assert not touched(ARM, scene.zones, row)
    assert accepted > 0.02 * COUNT
    assert refused > 0.02 * COUNT


def test_a_thin_pole_is_not_missed_between_two_points() -> None:
    """A blade of 0.2 mm across a trajectory of two points, met for a millisecond."""
    radius = ARM.forward(REST).x
    pole = Cylinder("pole", 0.0, radius, 1e-4, 0.0, 0.6, links=("tool",))
    move = Trajectory(NAMES, (0.0, 0.4), (REST, REST._replace(j1=3.0)))
    with pytest.raises(ZoneError, match=r"tool comes too near to pole from 0\.2") as caught:
        Scene((pole,), margin=1e-3).check(ARM, move)
    error = caught.value
    assert (error.zone, error.link, error.margin) == ("pole", "tool", 1e-3)
    entry = (math.pi / 2 - math.asin(1.1e-3 / radius)) / 3.0 * 0.4
    assert error.time == pytest.approx(entry, abs=0.02)
    Scene((pole,), margin=1e-3).check(ARM, Trajectory(NAMES, (0.0, 0.4), (REST, REST)))


@pytest.mark.parametrize("margin", [1e-3, 5e-3, 0.02])
def test_the_margin_decides(margin: float) -> None:
    """The tool's point passes parallel to a wall, slightly inside and outside of the margin."""
    high = ARM.forward(REST).z
    move = Trajectory(NAMES, (0.0, 5.0), (REST, REST._replace(j1=1.0)))
    for miss, fine in ((1e-3, True), (-1e-3, False)):
        top = high - margin - miss
        scene = Scene((Box("wall", (-1, -1, 0), (1, 1, top), links=("tool",)),), margin=margin)
        if fine:
            scene.check(ARM, move)
            continue
        with pytest.raises(ZoneError) as caught:
            scene.check(ARM, move)
        assert caught.value.depth == pytest.approx(1e-3, abs=1e-9)
        assert caught.value.time == 0.0


def test_a_zone_that_contains_the_start_is_refused_with_numbers() -> None:
    pose = ARM.forward(REST)
    zone = Box("reader", (pose.x - 0.05, -0.1, 0.0), (pose.x + 0.1, 0.1, 0.3))
    move = point_to_point(NAMES, REST, REST._replace(j1=1.0), LIMITS)
    with pytest.raises(ZoneError, match=r"jaws .* reader at the start.* mm inside.*5 mm") as caught:
        Scene((zone,)).check(ARM, move)
    assert caught.value.time == 0.0
    assert caught.value.depth > 0.005


def test_the_table_is_kept_clear() -> None:
    move = point_to_point(NAMES, REST, REST._replace(j2=0.0), LIMITS)
    with pytest.raises(ZoneError) as caught:
        Scene(table_height=0.0).check(ARM, move)
    assert caught.value.zone == "table"
    # The lowest points of the jaws are 146.6 mm below the wrist, which is 135 mm above the base.
    assert caught.value.depth == pytest.approx(0.1466 - 0.135 + 0.005, abs=1e-6)
    Scene(table_height=-0.02).check(ARM, move)
    # A microplate is gripped with the tool 11 mm above the table.
    Scene(table_height=0.0).check(
        ARM, point_to_point(NAMES, REST, REST._replace(j2=0.02009), LIMITS)
    )


def test_the_gripper_is_kept_from_the_column() -> None:
    folded = REST._replace(j3=2.6, j4=1.5)
    with pytest.raises(ZoneError, match=r"comes too near to (link_1|base_link)"):
        Scene().check(ARM, point_to_point(NAMES, REST, folded, LIMITS))


def test_the_arm_may_stand_where_it_is_parked() -> None:
    parked = ((0.0, 0.2, 0.0, 0.0), (0.58611, 0.051, 2.4804, -1.9100))
    assert (Scene(table_height=0.0).clearance(ARM, parked) > 0.02).all()


def test_a_keep_in_zone_is_not_left() -> None:
    scene = Scene((Cylinder("cell", 0.0, 0.0, 0.6, -0.1, 0.9, keep_in=True),))
    inside = REST._replace(j3=2.0)
    with pytest.raises(ZoneError, match=r"cell from .* mm outside of the zone"):
        scene.check(ARM, point_to_point(NAMES, inside, REST, LIMITS))
    scene.check(ARM, point_to_point(NAMES, inside, inside._replace(j1=2.0), LIMITS))


def test_joints_that_a_trajectory_does_not_name_stay_where_they_are() -> None:
    scene = Scene(table_height=0.0)
    turn = point_to_point(NAMES[:1], (0.0,), (1.0,), LIMITS[:1])
    scene.check(ARM, turn, REST)
    with pytest.raises(ZoneError):
        scene.check(ARM, turn, REST._replace(j2=0.0))
    with pytest.raises(TrajectoryError, match="where j2, j3, j4 are"):
        scene.check(ARM, turn)
    with pytest.raises(TrajectoryError, match="j9 is not a joint"):
        scene.check(ARM, point_to_point(("j9",), (0.0,), (1.0,), LIMITS[:1]), REST)


def test_a_load_is_kept_clear_too() -> None:
    scene, joints = Scene(table_height=0.0), [REST._replace(j2=0.05)]
    plate = Prism(0.11908, 0.0, 0.064, 0.043, -0.17, -0.14)
    assert scene.carrying(plate).clearance(ARM, joints) == pytest.approx(0.05 + 0.135 - 0.17)
    assert scene.clearance(ARM, joints) == pytest.approx(0.05 + 0.135 - 0.1466)


PLATE = Prism(0.11908, 0.0, 0.064, 0.043, -0.1539, -0.14)
"""A microplate between the finger tips; its bottom is 9.8 mm below the tool's point."""


def down_to(z: float) -> Trajectory:
    """A motion of the lift to where the tool's point is at that height."""
    here = REST._replace(j2=0.1)
    return point_to_point(NAMES, here, here._replace(j2=0.1 + z - ARM.forward(here).z), LIMITS)


@pytest.mark.parametrize("holder", ["table", "nest"])
def test_a_load_may_touch_only_the_bodies_that_are_named(holder: str) -> None:
    point = ARM.forward(REST)
    if holder == "table":
        scene = Scene(table_height=0.0, margin=0.003)
    else:
        nest = Box(holder, (point.x - 0.05, -0.05, -0.1), (point.x + 0.05, 0.05, 0.0))
        scene = Scene((nest,), margin=0.003)
    standing = 0.1539 + ARM.tool.z
    with pytest.raises(ZoneError, match=rf"load comes too near to {holder} .* 3 mm is missed"):
        scene.carrying(PLATE).check(ARM, down_to(standing))
    held = scene.carrying(PLATE, touches=[holder])
    held.check(ARM, down_to(standing))
    held.check(ARM, down_to(standing - 0.8e-3))
    with pytest.raises(ZoneError, match=r"load .* 2\.0 mm inside; .* 1\.1 mm too deep") as caught:
        held.check(ARM, down_to(standing - 2e-3))
    assert caught.value.depth == pytest.approx(1.1e-3, abs=1e-6)
    # The gripper that holds it keeps its distance, and so does the load from all else.
    with pytest.raises(ZoneError, match=f"jaws comes too near to {holder}"):
        scene.carrying(replace(PLATE, low=-0.14), touches=[holder]).check(ARM, down_to(0.0))
    wall = Box("wall", (point.x + 0.07, -0.1, 0.0), (point.x + 0.1, 0.1, 0.3), links=("load",))
    beside = replace(held, zones=(*scene.zones, wall))
    with pytest.raises(ZoneError, match="load comes too near to wall"):
        replace(beside, margin=0.02).check(ARM, down_to(standing))


def test_a_load_may_touch_only_bodies_of_the_scene() -> None:
    with pytest.raises(ConfigurationError, match=r"load may touch 'rack', .* no zones and no tab"):
        Scene().carrying(PLATE, touches=["rack"])
    with pytest.raises(ConfigurationError, match=r"load may touch 'table', which is not in"):
        Scene((Cylinder("nest", 0.5, 0.0, 0.1, 0.0, 0.1),)).carrying(PLATE, touches=["table"])


def test_a_scene_may_be_made_of_lists() -> None:
    """A scene made in a program; its layout is cached by value."""
    zone = Box("box", [0.5, 0.5, 0.0], [0.6, 0.6, 0.1], links=["gripper"])  # type: ignore[arg-type]
    pole = Cylinder("pole", 0.5, -0.5, 0.1, 0.0, 0.1, links=["gripper"])  # type: ignore[arg-type]
    lists = Scene([zone, pole], mounted=list(GRIPPER))  # type: ignore[arg-type]
    lists.check(ARM, point_to_point(NAMES, REST, REST._replace(j2=0.3), LIMITS))
    box = Box("box", (0.5, 0.5, 0.0), (0.6, 0.6, 0.1), links=("gripper",))
    assert lists == Scene((box, replace(pole, links=("gripper",))))
    assert hash(lists) == hash(replace(lists))


def test_joints_that_are_not_finite_are_refused() -> None:
    scene = Scene(table_height=0.0)
    turn = point_to_point(NAMES[:1], (0.0,), (1.0,), LIMITS[:1])
    with pytest.raises(InvalidArgumentError, match="a joint is at nan"):
        scene.clearance(ARM, [(0.0, math.nan, 0.0, 0.0)])
    with pytest.raises(InvalidArgumentError, match="a joint is at inf"):
        scene.check(ARM, turn, (0.0, math.inf, 0.0, 0.0))
    far = Trajectory(NAMES, (0.0, 1.0), (REST, REST._replace(j4=1e9)))
    with pytest.raises(TrajectoryError, match="check the limits"):
        scene.check(ARM, far)


GOOD = """\
version: 1
table_height: 0.0
margin: 0.005
zones:
  - {name: reader, keep: out, shape: box, lower: [0.3, 0.1, 0.0], upper: [0.5, 0.3, 0.2], yaw: 0.1}
  - {name: cell, keep: in, shape: cylinder, x: 0.0, y: 0.0, radius: 0.9, low: -0.1, high: 1.0}
  - {name: hood, keep: in, shape: cylinder, x: 0, y: 0, radius: 0.7, low: 0, high: 1, links: [tool]}
"""


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "scene.yaml"
    path.write_text(text)
    return path


def test_a_scene_is_read(tmp_path: Path) -> None:
    assert read_scene(written(tmp_path, GOOD)) == Scene(
        (
            Box("reader", (0.3, 0.1, 0.0), (0.5, 0.3, 0.2), 0.1),
            Cylinder("cell", 0.0, 0.0, 0.9, -0.1, 1.0, keep_in=True),
            Cylinder("hood", 0.0, 0.0, 0.7, 0.0, 1.0, keep_in=True, links=("tool",)),
        ),
        0.0,
        0.005,
    )
    empty = GOOD[: GOOD.index("zones:")].replace("0.0\n", "null\n", 1) + "zones: []\n"
    assert read_scene(written(tmp_path, empty)) == Scene()
    assert read_scene(str(written(tmp_path, empty))) == Scene()


@given(st.integers(0, 2**32 - 1), st.text(st.characters(categories=["L", "P", "S"]), min_size=1))
def test_every_scene_is_read_as_it_was_saved(
    tmp_path_factory: pytest.TempPathFactory, seed: int, name: str
) -> None:
    path = tmp_path_factory.mktemp("scenes") / "scene.yaml"
    scene = random_scene(np.random.default_rng(seed))
    first, *others = scene.zones or (Box("first", (0.0, 0.0, 0.0), (0.1, 0.1, 0.1)),)
    named = replace(scene, zones=(replace(first, name=f"x{name}"[:90]), *others), mounted=GRIPPER)
    save_scene(path, named)
    assert read_scene(path) == replace(named, widths=Scene().widths)


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ("version: 1", "version: 3", r"line 1: version: 3 cannot be read.*reads 1"),
        ("margin: 0.005\n", "", "margin is missing"),
        ("margin: 0.005", "margin: 0", r"line 3: margin: 0 is outside 0\.001 \.\. 0\.1 m"),
        ("margin: 0.005", "margin: .nan", "line 3: margin: nan is outside"),
        ("table_height: 0.0", "table_height: .inf", "line 2: table_height: inf is outside"),
        ("margin", "magrin", "line 3: magrin is not a known parameter; did you mean margin"),
        ("keep: out", "keep: off", r"line 5: zones\[0\].keep: 'off' .* must be 'in' or 'out'"),
        ("[0.3, 0.1, 0.0]", "[0.3, 0.1]", r"line 5: zones\[0\].lower\[2\] is missing"),
        ("[0.3, 0.1, 0.0]", "[300, 100, 0]", "line 5: zone reader: x: 300 m.*millimetres"),
        ("[0.3, 0.1, 0.0]", "[0.3, 0.1, .nan]", "line 5: zone reader: z is nan"),
        ("[0.3, 0.1, 0.0]", "[0.3, 0.4, 0.0]", "line 5: zone reader: y goes from"),
        ("radius: 0.9", "radius: 0", "line 6: zone cell: radius: 0 m is outside"),
        ("radius: 0.9", "diameter: 0.9", "line 6: .*diameter is not a known parameter"),
        ("name: cell", "name: reader", r"line 6: zones\[1\].name: reader is there twice"),
        ("name: cell", "name: table", "line 6: zone table: the name is taken"),
        ("[tool]", "[tol]", "line 7: zone hood: 'tol' is not a link that moves; those are link_1"),
        ("yaw: 0.1", "yaw: 90", r"line 5: zone reader: yaw: 90 rad is outside"),
        ("zones:", "zones: [", "line 5"),
    ],
)  # fmt: skip
def test_a_scene_file_is_strict(tmp_path: Path, old: str, new: str, complaint: str) -> None:
    with pytest.raises(ConfigurationError, match=complaint):
        read_scene(written(tmp_path, GOOD.replace(old, new, 1)))


@pytest.mark.parametrize("number", ["-1" + "0" * 400, ".inf", "-.inf", "1.0e+300"])
def test_a_corner_out_of_range_is_refused(tmp_path: Path, number: str) -> None:
    zone = f"{{name: a, keep: out, shape: box, lower: [{number}, 0, 0], upper: [1, 1, 1]}}"
    text = GOOD[: GOOD.index("zones:")] + f"zones:\n  - {zone}\n"
    with pytest.raises(
        ConfigurationError, match=r"line 5: .*(lower\[0\]|x).* (too large|outside|not a fin)"
    ):
        read_scene(written(tmp_path, text))


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"nowhere\.yaml: No such file"):
        read_scene(tmp_path / "nowhere.yaml")


@given(st.sampled_from([math.nan, math.inf, -math.inf]), st.integers(0, 5))
@settings(max_examples=20)
def test_zones_that_are_not_finite_are_refused(value: float, which: int) -> None:
    corners = [0.1, 0.1, 0.1, 0.2, 0.2, 0.2]
    corners[which] = value
    with pytest.raises(ConfigurationError, match="zone box"):
        Box("box", (*corners[:3],), (*corners[3:],))  # type: ignore[arg-type]


@given(SEEDS)
@settings(max_examples=examples(15))
def test_the_nearest_pair_has_the_clearance_of_the_scene(seed: int) -> None:
    rng = np.random.default_rng(seed)
    joints, scene = random_joints(rng), replace(random_scene(rng), margin=OWN_MARGIN)
    pair = scene.nearest_pair(ARM, joints)
    assert pair is not None
    assert pair.distance == pytest.approx(float(scene.clearance(ARM, [joints])[0]))


def test_the_distance_of_a_load_to_what_it_may_touch_is_the_true_one() -> None:
    tool = ARM.tool
    load = Prism(tool.x, tool.y, 0.01, 0.01, tool.z - 0.05, tool.z)
    scene = Scene(table_height=0.0).carrying(load, ("table",))
    lift = 0.0505 - tool.z - ARM.geometry.height
    pair = scene.nearest_pair(ARM, Joints(0.0, lift, 0.8, 0.0))
    assert pair is not None
    assert (pair.link, pair.other) == ("load", "table")
    assert pair.distance == pytest.approx(0.5e-3)
    assert pair.margin == pytest.approx(-GOAL_SLACK)
