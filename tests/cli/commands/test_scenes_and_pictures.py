"""``--scene`` and ``--plot``: the zones that the arm avoids, and the picture of a motion."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import numpy as np
import pytest

from bioscara.cli import main
from bioscara.cli.shared_arguments import START
from bioscara.kinematics import Joints
from bioscara.planning import read, write_csv
from bioscara.planning.files.scene_file import read_scene
from bioscara.planning.motions.point_to_point import point_to_point
from bioscara.robot import kinematics_of
from cli.commands.pictures import PARAMETERS, expected, size
from cli.said import Said

pytestmark = pytest.mark.thorough

pytest.importorskip("matplotlib")

EXAMPLE = Path(__file__).parents[3] / "examples" / "scene.yaml"
CENTER = (0.0, 0.2, 0.0, 0.0)
PLATE = (0.3, 0.1, 0.8, -0.4)
WAY = tuple(0.5 * (a + b) for a, b in zip(START, PLATE, strict=True))
SCENE = """\
version: 1
table_height: null
margin: 0.005
zones:
  - {name: post, keep: out, shape: cylinder, x: %g, y: %g, radius: 0.02, low: 0.0, high: 0.6}
"""

WORLD = """\
version: 2
table: null
margin: 0.005
walls: [{name: w, lower: [%g, %g, 0.0], upper: [%g, %g, 0.6]}]
"""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a scene for every kind of error, and poses."""
    monkeypatch.chdir(tmp_path)
    arm = kinematics_of(PARAMETERS)
    for name, joints in (("start", START), ("way", WAY), ("goal", PLATE)):
        x, y, *_ = arm.forward(joints)
        (tmp_path / f"{name}.yaml").write_text(SCENE % (x, y))
    (tmp_path / "world.yaml").write_text(WORLD % (x - 0.1, y - 0.1, x + 0.1, y + 0.1))
    (tmp_path / "wrong.yaml").write_text(SCENE.replace("radius", "diameter") % (0.5, 0.5))
    (tmp_path / "full.png").symlink_to("/dev/full")
    (tmp_path / "millimetres.yaml").write_text(SCENE % (500, 0.5))
    main(["poses", "save", "plate", "--joints", *map(str, PLATE)])
    main(["poses", "save", "beside", "--pose", "0.45", "0.2", "0.25", "0"])
    return tmp_path


def test_a_pose_is_drawn_as_the_motion_to_it(folder: Path, said: Said) -> None:
    told = said.output("poses show plate")
    assert said.output("poses show plate --plot a.png") == told + "wrote a.png\n"
    assert size(folder / "a.png") == (1900, 1300)
    assert (folder / "a.png").read_bytes() == expected(folder, START, PLATE, "pose plate")
    start, words = (-0.4, 0.25, 0.6, 0.1), ["--from", "-0.4", "0.25", "0.6", "0.1"]
    shown = ["poses", "show", "plate", *words, "--plot", "b.png", "--scene", str(EXAMPLE)]
    assert main(shown) == 0
    around = read_scene(EXAMPLE)
    assert (folder / "b.png").read_bytes() == expected(folder, start, PLATE, "pose plate", around)


def test_a_pose_of_another_tool_is_drawn_with_that_tool(folder: Path) -> None:
    table, needle = folder / "poses.yaml", "needle: {x: 0.0, y: 0.0, z: -0.2, yaw: 0.0, mass: 0.1}"
    table.write_text(table.read_text().replace("tools: {}", f"tools:\n  {needle}"))
    place = ["--pose", "0.4", "0.2", "0.2", "0", "--tool", "needle"]
    assert main(["poses", "save", "prick", *place]) == 0
    assert main(["poses", "show", "prick", "--plot", "a.png"]) == 0
    assert size(folder / "a.png") == (1900, 1300)


@pytest.mark.parametrize("command", ["plan", "move"])
def test_a_motion_among_zones_is_drawn_with_them(command: str, folder: Path) -> None:
    words = [command, "--joints", *map(str, PLATE), "--plot"]
    assert main([*words, "b.png", "--scene", str(EXAMPLE)], paced=False) == 0
    assert size(folder / "b.png") == (1900, 1300)
    if command == "plan":
        around = read_scene(EXAMPLE)
        picture = expected(folder, START, PLATE, "plan", around)
        assert (folder / "b.png").read_bytes() == picture
    else:  # Where homing ends differs from arm to arm.
        assert main([*words, "a.png"], paced=False) == 0
        assert size(folder / "a.png") == (1900, 1300)
        assert (folder / "a.png").read_bytes() != (folder / "b.png").read_bytes()


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        ("--plot nowhere/a.png", r"nowhere/a.png cannot be written: there is no folder nowhere$"),
        ("--plot .", r"\. cannot be written: it is a folder; name a file in it$"),
        ("--plot a.pdf", r"--plot a.pdf: pictures are PNG; name .* \.png, for example a\.png$"),
        ("--plot picture", r"for example picture\.png$"),
        ("--plot full.png", r"full.png cannot be written: No space left on device$"),
        ("--scene none.yaml", r"none.yaml: No such file or directory"),
        ("--scene wrong.yaml", r"wrong.yaml, line 5: .*diameter"),
        ("--scene millimetres.yaml", r"millimetres.yaml, line 5: .*500 m .*millimetres\?"),
        ("--scene start.yaml", r"post at the start, nearest at .* s: [\d.]+ mm inside; the margin "
         r"of 5 mm is missed by [\d.]+ mm"),
        ("--scene way.yaml", r"post from [\d.]+ s on, nearest at .* s: [\d.]+ mm inside"),
        ("--scene goal.yaml", r"too near to post (from [\d.]+ s on|at the target).* is missed by"),
        ("--world none.yaml", r"none.yaml: No such file or directory"),
        ("--world wrong.yaml", r"wrong.yaml, line 5: .*diameter"),
        ("--world goal.yaml", r"too near to post (from [\d.]+ s on|at the target).* is missed by"),
        ("--world world.yaml", r"too near to w (from [\d.]+ s on|at the target).* is missed by"),
        ("--scene world.yaml", r"world.yaml, line 1: .*give it as --world FILE"),
        ("--scene goal.yaml --world world.yaml", "--scene and --world exclude one another"),
        ("--from 9 0.2 0 0", r"--from is outside the limits: j1 at 9"),
        ("--from nan 0.2 0 0", r"--from is outside the limits: j1 .*nan"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("command", ["plan --joints 0.3 0.1 0.8 -0.4", "poses show plate"])
def test_a_motion_that_cannot_be_drawn_is_refused_and_leaves_no_file(
    command: str, words: str, complaint: str, folder: Path, said: Said
) -> None:
    before = sorted(folder.iterdir())
    plot = [] if "--plot" in words else ["--plot", "a.png"]
    status, out, err = said(command, *words.split(), *plot)
    assert status == 2
    assert re.search(complaint, err.strip())
    assert len(err.splitlines()) == 1
    if command.startswith("poses"):
        assert out == ""
    assert sorted(folder.iterdir()) == before


def test_an_unreachable_pose_is_shown_but_not_drawn(folder: Path, said: Said) -> None:
    table = folder / "poses.yaml"
    table.write_text(table.read_text().replace("x: 0.45", "x: 0.95"))
    assert re.search(r"reachable +no: .*beyond the reach", said.output("poses show beside"))
    err = said.refusal("poses show beside --plot a.png")
    assert "beyond the reach of 0.6145 m" in err
    assert not (folder / "a.png").exists()


@pytest.mark.parametrize("command", ["plan --name plate", "move --name plate", "poses show plate"])
def test_without_matplotlib_every_command_says_what_to_install(
    command: str, monkeypatch: pytest.MonkeyPatch, said: Said
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    err = said.refusal(command, "--plot", "a.png")
    assert "pip install 'bioscara[plot]'" in err


def test_an_arm_is_not_moved_into_a_zone(folder: Path, said: Said) -> None:
    err = said.refusal("move --name plate --scene goal.yaml")  # neither greeted nor homed
    assert re.search(r"comes too near to post at the target; .* is missed by [\d.]+ mm", err)
    assert "homing" not in said("move --name plate --scene wrong.yaml").out


def write_motion(path: Path, names: list[str], start: Joints, goal: Joints) -> None:
    limits = [limit for limit in PARAMETERS.joints if limit.name in names]
    here, there = ([getattr(joints, name) for name in names] for joints in (start, goal))
    write_csv(path, point_to_point(names, here, there, limits))


def test_a_trajectory_is_kept_clear_of_the_scene(folder: Path, said: Said) -> None:
    names = [limit.name for limit in PARAMETERS.joints]
    write_motion(folder / "m.csv", names, Joints(*START), Joints(*PLATE))
    status, out, err = said("run m.csv --scene way.yaml --out a")
    assert status == 2
    assert out == ""  # neither greeted nor homed
    assert re.search(r"comes too near to post from .* mm inside", err)
    assert not (folder / "a").exists()
    assert main(["run", "m.csv", "--scene", str(EXAMPLE), "--out", "b"], paced=False) == 0


def test_the_ramp_to_a_trajectory_is_kept_clear_too(folder: Path, said: Said) -> None:
    """The trajectory is free, the post stands between it and the arm's position after homing."""
    names = [limit.name for limit in PARAMETERS.joints]
    write_motion(folder / "m.csv", names, Joints(*CENTER), Joints(*CENTER)._replace(j1=0.3))
    (folder / "between.yaml").write_text(SCENE % (0.28, -0.35))
    err = said.failure("run m.csv --scene between.yaml --out a", status=1)
    assert re.search(r"comes too near to post from .* mm inside", err)
    trajectory = read(folder / "a" / "trajectory.csv").trajectory
    assert np.allclose(trajectory.positions[0], CENTER)
    assert "approach" not in (folder / "a" / "samples.csv").read_text()


def test_a_trajectory_of_some_joints_is_checked_with_the_others_measured(
    folder: Path, said: Said
) -> None:
    home = Joints(-2.9, 0.3, 2.4, 2.7)
    write_motion(folder / "m.csv", ["j1"], home, home._replace(j1=0.0))
    (folder / "around.yaml").write_text(SCENE % (0.08, -0.29))
    assert main(["run", "m.csv", "--out", "a"], paced=False) == 0
    assert "comes too near to post" in said.failure(
        "run m.csv --scene around.yaml --out b", status=1
    )
