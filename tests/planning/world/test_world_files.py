"""World files: written ones are read, planned for and described to editors."""

from __future__ import annotations

import json
import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fastjsonschema
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st
from ruamel.yaml import YAML
from tools.world_schema import SCHEMA, schema

from bioscara.errors import ConfigurationError
from bioscara.model.labware import LABWARE, labware_table
from bioscara.planning.files.scene_file import read_scene
from bioscara.planning.world import Item, World, read_world
from entries import entry
from laws import examples

EXAMPLES = Path(__file__).parents[3] / "examples"
KINDS = labware_table()
STACKABLE = [name for name, kind in KINDS.items() if kind.stackable]
Values = dict[str, Any]
valid: Callable[[Values], object] = fastjsonschema.compile(json.loads(SCHEMA.read_text()))
PLACES = st.tuples(
    st.sampled_from([0.5, 0.7, 0.9, 1.1]), st.sampled_from([-0.4, -0.2, 0, 0.2, 0.4])
)
YAWS = st.floats(-3.0, 3.0)
ONES = st.fixed_dictionaries(
    {
        "support": st.sampled_from(["table", "nest", "hotel"]),
        "kind": st.sampled_from(STACKABLE),
        "count": st.integers(0, 4),
        "yaw": YAWS,
        "z": st.floats(0.02, 0.2),
        "mass": st.none() | st.floats(0.01, 0.5),
        "on_top": st.none() | st.sampled_from([*KINDS]),
    }
)


def written(folder: Path, values: Values) -> Path:
    """Return a file with a world, each entry on a line of its own."""
    file = folder / "world.yaml"
    lines = []
    for key, value in values.items():
        if isinstance(value, list) and value:
            lines += [f"{key}:", *(f"  - {json.dumps(each)}" for each in value)]
        else:
            lines.append(f"{key}: {json.dumps(value)}")
    file.write_text("\n".join([*lines, ""]).replace("NaN", ".nan").replace("Infinity", ".inf"))
    return file


def base(**more: object) -> Values:
    table = {"height": 0.0, "lower": [-0.8, -0.8], "upper": [1.5, 0.8]}
    return {"version": 2, "margin": 0.005, "table": table, **more}


def refusal(folder: Path, values: Values) -> str:
    file = written(folder, values)
    with pytest.raises(ConfigurationError) as caught:
        read_world(file)
    return str(caught.value).replace(f"{folder}/", "")


@settings(
    max_examples=examples(20),
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(ones=st.dictionaries(PLACES, ONES, max_size=6))
def test_a_world_is_as_its_file_says(
    tmp_path: Path, ones: dict[tuple[float, float], dict[str, Any]]
) -> None:
    values = base(nests=[], hotels=[], stacks=[], labware=[])
    expected: dict[str, tuple[str, float, float, float, float, float]] = {}
    for number, ((x, y), one) in enumerate(ones.items()):
        yaw, kind, name = one["yaw"], KINDS[one["kind"]], f"n{number}"
        place: Values = {"place": name}
        z = one["z"]
        if one["support"] == "nest":
            values["nests"].append({"name": name, "x": x, "y": y, "z": z, "yaw": yaw})
        elif one["support"] == "hotel":
            hotel = {"name": name, "x": x, "y": y, "z": z, "yaw": yaw}
            values["hotels"].append({**hotel, "levels": 2, "pitch": 0.5})
            place, z = {"place": f"{name}/2"}, z + 0.5
        else:
            place, z = {"x": x, "y": y, "z": 0.0, "yaw": yaw}, 0.0
        mass = {} if one["mass"] is None else {"mass": one["mass"]}
        if one["count"]:
            stack = {"name": f"s{number}", "kind": kind.name, "count": one["count"]}
            values["stacks"].append({**stack, **place, **mass})
            for level in range(one["count"]):
                at = (kind.name, x, y, z, yaw, mass.get("mass", kind.mass))
                expected[f"s{number}/{level + 1}"] = at
                z += kind.stack_height
            place = {"place": f"s{number}/{one['count']}"}
        if one["on_top"]:
            top = {"name": f"t{number}", "kind": one["on_top"]}
            values["labware"].append({**top, **place})
            expected[f"t{number}"] = (one["on_top"], x, y, z, yaw, KINDS[one["on_top"]].mass)
    file = written(tmp_path, values)
    valid(YAML(typ="safe").load(file))
    world = read_world(file)
    assert {item.name for item in world.items} == {*expected}
    for item in world.items:
        kind, *numbers = expected[item.name]
        assert item.labware.name == kind
        assert [item.x, item.y, item.z, item.yaw, item.mass] == pytest.approx(numbers)
    require_planned(world)


def require_planned(world: World) -> None:
    """Make sure that the planner has each body where the world has it."""
    scene = world.planned
    zones = {zone.name: zone for zone in scene.zones}
    assert world.table is None or scene.table_height == world.table.height
    for body in (*world.walls, *world.nests, *world.items):
        with entry(body.name):
            zone, shape = zones[body.name].shape, body.shape
            assert (zone.yaw, zone.low) == (shape.yaw, shape.low)
            plan = [zone.x, zone.y, zone.half_x, zone.half_y]
            assert plan == pytest.approx([shape.x, shape.y, shape.half_x, shape.half_y])
            # A load may go between guides, and over the edge of the plate below.
            top = body.top if not hasattr(body, "upper") else shape.high
            assert zone.high == pytest.approx(top)
            if isinstance(body, Item):
                core = zones[f"{body.name}/core"].shape
                assert (core.low, core.high) == (shape.low, shape.high)
                assert 0.0 < core.half_y < body.grip.width / 2.0 - scene.margin


def test_the_committed_schema_is_current() -> None:
    assert schema() == SCHEMA.read_text()


def test_the_example_is_a_world_of_two_nests() -> None:
    world = read_world(EXAMPLES / "world.yaml")
    valid(YAML(typ="safe").load(EXAMPLES / "world.yaml"))
    (plate,) = world.items
    assert [nest.name for nest in world.nests] == ["a", "b"]
    assert (plate.name, plate.on, plate.labware.name) == ("plate", "a", "microplate_96")
    require_planned(world)


def test_a_scene_file_is_a_world_without_bodies() -> None:
    path = EXAMPLES / "scene.yaml"
    assert read_world(path) == World(read_scene(path))
    assert read_world(path).planned == read_scene(path)


def test_own_labware_is_beside_the_world(tmp_path: Path) -> None:
    mine = YAML(typ="safe").load(LABWARE)["labware"][0] | {"name": "mine", "mass": 0.2}
    (tmp_path / "kinds").mkdir()
    (tmp_path / "kinds/mine.yaml").write_text(json.dumps({"version": 1, "labware": [mine]}))
    piece = {"name": "p", "kind": "mine", "x": 0.6, "y": 0.0, "z": 0.0}
    world = read_world(written(tmp_path, base(labware_files=["kinds/mine.yaml"], labware=[piece])))
    assert world.items[0].mass == 0.2


def piece(name: str = "p", /, **values: object) -> Values:
    return {"name": name, "kind": "microplate_96", **values}


def nest(name: str = "n", /, **values: object) -> Values:
    return {"name": name, "x": 0.6, "y": 0.0, "z": 0.02, **values}


def wall(name: str = "w", /, **values: object) -> Values:
    return {"name": name, "lower": [0.5, 0.2, 0.0], "upper": [0.6, 0.3, 0.2], **values}


def zone(name: str, high: float) -> Values:
    shape = {"shape": "box", "lower": [0, 0, 1], "upper": [1, 1, high]}
    return {"name": name, "keep": "out", **shape}


LYING = {"x": 0.6, "y": 0.0, "z": 0.0}
"""A place on the table."""
NAN, INF = float("nan"), float("inf")


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"labware": [piece(**LYING, mass=0)]}, r"line 5: labware\[0\].mass: 0 is outside"),
        ({"labware": [piece(**LYING, mass=-1)]}, "mass: -1 is outside 0.001 .. 3 kg"),
        ({"labware": [piece(**LYING, mass=NAN)]}, "mass: nan is outside"),
        ({"labware": [piece(x=INF, y=0, z=0)]}, r"labware\[0\].x: inf is outside -10 .. 10"),
        ({"nests": [nest(x=350)]}, r"nests\[0\].x: 350 is outside -10 .. 10 m"),
        ({"nests": [nest(height=0)]}, r"nests\[0\].height: 0 is outside 0.001 .. 0.05 m"),
        ({"labware": [piece(**LYING) | {"kind": "microplate_98"}]},
         r"line 5: p, kind: .* no kind of labware 'microplate_98'; did you mean microplate_96\?"),
        ({"labware": [piece(place="nn")], "nests": [nest()]},
         r"p, place: there is no nest or labware 'nn'; did you mean n\?"),
        ({"labware": [piece(place="p")]}, r"p stands on itself, by way of p; correct 'place'"),
        ({"labware": [piece()]}, r"labware\[0\].place is missing; give x, y and z, or 'place'"),
        ({"labware": [piece(x=0.6)]}, r"labware\[0\].y is missing; give x, y and z"),
        ({"labware": [piece(place="n", x=0.0)], "nests": [nest()]},
         r"labware\[0\].x: follows from 'place'; leave out one of them"),
        ({"labware": [piece(**LYING, mesh="plate.stl")]},
         r"line 5: labware\[0\]: mesh: bodies are boxes, and no meshes are read; give a kind"),
        ({"labware": [piece(**LYING, masss=1)]}, r"masss is not .*; did you mean mass\?"),
        ({"nestss": []}, r"nestss is not a known parameter; did you mean nests\?"),
        ({"labware_files": ["none.yaml"]},
         r"line 5: labware_files: there is no file none.yaml; correct its name"),
        ({"labware": [piece(**LYING), piece("q", x=0.7, y=0.01, z=0)]},
         r"line 6: q is in p: they overlap by 14.3 mm; move one of them"),
        ({"nests": [nest(), nest("m", y=0.05)]}, r"line 6: m is in n: they overlap by 11.0 mm"),
        ({"walls": [wall(), wall("v")]}, r"line 6: v is in w: they overlap by 100.0 mm"),
        ({"walls": [wall()], "labware": [piece(x=0.5, y=0.2, z=0)]}, "p is in w: they overlap by"),
        ({"nests": [nest()], "labware": [piece(place="n"), piece("q", place="n")]},
         r"line 8: q is in p: they overlap by 14.3 mm"),
        ({"labware": [piece(x=0.6, y=0, z=0.1)]},
         r"p stands on nothing: its bottom is at z = 0.1 m, and below .* is table at z = 0 m"),
        ({"labware": [piece(x=5, y=0, z=0)]}, r"and below its centre there is nothing"),
        ({"labware": [piece(x=0.6, y=0, z=-0.01)]}, "nothing: its bottom is at z = -0.01"),
        ({"walls": [wall(lower=[0.5, 0.2, -0.01])]},
         r"line 5: w is in the table, whose top is at z = 0 m, by 10.0 mm; move it up"),
        ({"nests": [nest(z=-0.005)]}, "n is in the table, whose top is at z = 0 m, by 5.0 mm"),
        ({"nests": [nest(yaw=0.3)], "labware": [piece(x=0.6, y=0, z=0.02)]},
         r"p does not fit into n: a corner is 8.8 mm outside its guides"),
        ({"labware": [{"name": "r", "kind": "tip_rack_300", **LYING}, piece(place="r")]},
         r"p cannot stand on r: tip_rack_300 is not stackable; give it another place"),
        ({"walls": [wall(lower=[-0.05, -0.05, 0], upper=[0.05, 0.05, 0.1])]},
         r"line 5: w is in the arm by [\d.]+ mm: in its base_link as it stands after homing"),
        ({"walls": [wall(lower=[-0.7, -0.7, 0], upper=[0.7, 0.7, 0.4])]}, "w is in the arm by"),
        ({"table": {"height": 0.1, "lower": [-1, -1], "upper": [1, 1]}}, "table is in the arm by"),
        ({"table": {"height": 0.0, "lower": [1, -1], "upper": [-1, 1]}},
         r"line 3: table.upper\[0\]: -1 must be above 1"),
        ({"table": 0.0}, "table must be a mapping of names to values"),
        ({"nests": [nest("link_2")]}, "link_2: the name is taken by the table"),
        ({"nests": [nest(), nest("m", y=0.3)], "walls": [wall("m", yaw=0.1)]},
         r"line \d: m: the name is there twice; choose another one"),
        ({"nests": [nest("a b")]}, "'a b' is not a valid name"),
        ({"zones": [zone("n", 2)],
          "nests": [nest()]}, "n: the name is there twice"),
        ({"zones": [zone("z", 1)]},
         "line 5: zone z: z goes from 1 m to 1 m; the first must be the smaller"),
        ({"stacks": [piece("s", count=51, **LYING)]}, r"stacks\[0\].count: 51 is outside 1 .. 50"),
        ({"hotels": [nest("h", levels=50, pitch=0.3)]},
         "line 5: h: Nest: z: 10.22 is outside -10 .. 10 m"),
        ({"hotels": [nest("h", levels=2, pitch=0.01)]}, "h/2 is in h/1: they overlap by 1.0 mm"),
        ({"version": 3}, "line 1: version: 3 cannot be read; .* reads 1 and 2"),
        ({"version": None}, "version: None is not a whole number"),
        ({"margin": 5}, "line 2: margin: 5 is outside 0.001 .. 0.1 m"),
    ],
)  # fmt: skip
def test_what_cannot_be_a_world_is_refused(tmp_path: Path, values: Values, message: str) -> None:
    text = refusal(tmp_path, base() | values)
    assert re.search(message, text), text
    assert text.startswith("world.yaml, line "), text


def test_too_many_bodies_are_refused_at_once(tmp_path: Path) -> None:
    stacks = [piece(f"s{n}", count=50, x=0.4, y=0.0, z=0.0) for n in range(5)]
    begin = time.perf_counter()
    assert "250 walls, nests and pieces of labware; a world has at most 200" in refusal(
        tmp_path, base(stacks=stacks)
    )
    many = [piece(f"p{n}", **LYING) for n in range(10_000)]
    assert re.search(
        "larger than 1 MiB|more than 6000 names", refusal(tmp_path, base(labware=many))
    )
    assert time.perf_counter() - begin < 5.0


def test_a_world_given_as_a_scene_is_recognised() -> None:
    with pytest.raises(ConfigurationError, match=r"line 2: .* give it as --world FILE"):
        read_scene(EXAMPLES / "world.yaml")
