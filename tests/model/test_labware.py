"""The labware table: every kind fits the arm and the standard; own files are read as strictly."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML

from bioscara.errors import ConfigurationError
from bioscara.model import load_parameters
from bioscara.model.labware import LABWARE, labware_table
from bioscara.model.parts import hand
from entries import entry

TABLE = labware_table()
PLATE = YAML(typ="safe").load(LABWARE)["labware"][0]
SLAS = (0.12776, 0.08548)
"""Footprint of ANSI/SLAS 1-2004 [m]; its tolerance is 0.5 mm along the sides."""


def own(folder: Path, *kinds: dict[str, Any], name: str = "own.yaml") -> Path:
    file = folder / name
    entries = "".join(f"- {json.dumps(kind)}\n" for kind in kinds)
    file.write_text(f"labware:\n{entries}version: 1\n".replace("NaN", ".nan"))
    return file


def test_every_kind_fits_the_standard_and_the_jaws() -> None:
    arm = load_parameters()
    finger = min(corner for part in hand()[1].bodies["finger"] for _, _, corner in lows(part))
    below = arm.geometry.tool_z - finger
    for name, kind in TABLE.items():
        with entry(name):
            assert kind.name == name
            assert kind.source
            for size, standard in zip(kind.size[:2], SLAS, strict=True):
                assert abs(size - standard) <= 5e-4
            assert arm.gripper.lower < kind.grip_width < arm.gripper.upper
            # The fingers are above its support, by the usual margin and a nest's guides.
            assert kind.grip_height - below >= 5e-3 + 3e-3 or kind.size[2] < 0.01
            assert kind.stack_height == kind.size[2] - kind.rim


def lows(part: Any) -> list[tuple[float, float, float]]:
    return [(0.0, 0.0, upright[4]) for upright in part.solid.uprights]


def test_the_kinds_that_a_lab_needs_are_there() -> None:
    words = "microplate_96 microplate_384 deep_well lid tip_rack tube_rack reservoir"
    assert [word for word in words.split() if not any(word in name for name in TABLE)] == []


def test_labware_of_a_file_is_added(tmp_path: Path) -> None:
    mine = own(tmp_path, PLATE | {"name": "mine", "mass": 0.1, "mass_assumed": False})
    table = labware_table(mine)
    assert [*table] == [*TABLE, "mine"]
    assert (table["mine"].mass, table["mine"].mass_assumed) == (0.1, False)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"mass": 0}, r"own.yaml, line 2: labware\[0\].mass: 0 is outside 0.001 .. 3 kg"),
        ({"mass": -0.05}, r"mass: -0.05 is outside"),
        ({"mass": float("nan")}, r"mass: nan is outside"),
        ({"size": [127.76, 85.48, 14.35]}, r"size\[0\]: 127.76 is outside 0.001 .. 0.5 m"),
        ({"size": [0.12, 0.08]}, r"size\[2\] is missing"),
        ({"grip_height": 0.02}, r"grip_height: 0.02 is outside 0 .. 0.01435 m"),
        ({"grip_width": 0.1}, r"grip_width: 0.1 is outside 0 .. 0.08548 m"),
        ({"rim": 0.01}, r"rim: 0.01 is outside 0 .. 0.007175 m"),
        ({"stackable": "yes"}, r"stackable: 'yes' is neither true nor false"),
        ({"name": "96 wells"}, r"'96 wells' is not a valid name"),
        ({"name": "microplate_96"}, r"line 2: labware microplate_96 is known already from another"),
        ({"grip_hight": 0.01}, r"grip_hight is not a known parameter; did you mean grip_height\?"),
        ({"mesh": "plate.stl"}, r"mesh is not a known parameter; known here: name, title, size"),
    ],
)
def test_what_cannot_be_used_is_refused(
    tmp_path: Path, changes: dict[str, Any], message: str
) -> None:
    with pytest.raises(ConfigurationError, match=message):
        labware_table(own(tmp_path, PLATE | {"name": "mine"} | changes))


def test_files_that_do_not_fit_one_another_are_refused(tmp_path: Path) -> None:
    mine = PLATE | {"name": "mine"}
    with pytest.raises(ConfigurationError, match=r"labware\[1\].name: mine is there twice"):
        labware_table(own(tmp_path, mine, mine))
    with pytest.raises(ConfigurationError, match="201 kinds; at most 200 are read"):
        labware_table(own(tmp_path, *({**mine, "name": f"k{n}"} for n in range(201))))
    missing = tmp_path / "none.yaml"
    with pytest.raises(ConfigurationError, match=re.escape(f"{missing}: No such file")):
        labware_table(missing)
