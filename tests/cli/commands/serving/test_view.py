"""``bioscara view`` from a terminal."""

from __future__ import annotations

import re
import signal
import subprocess
from collections.abc import Callable
from pathlib import Path

import httpx
import pytest

from bioscara.api.gateway_pages import page_of
from bioscara.cli import main
from bioscara.cli.parser import parse
from bioscara.cli.shared_arguments import START
from bioscara.cli.view_source import viewed_from
from bioscara.dashboard.viewed import Viewed
from bioscara.model import load_parameters
from bioscara.planning import Trajectory, write_csv
from bioscara.planning.files.scene_file import read_scene
from bioscara.report import CycleRecord, JointRecord, Phase, SampleQuality
from bioscara.report.sample_file import header, row
from bioscara.web.access.tokens import default_path
from cli.said import Said
from served import NAME, arm_served

NAMES = ("j1", "j2", "j3", "j4")
EXAMPLE = Path(__file__).parents[4] / "examples" / "scene.yaml"


def viewed(words: str) -> Viewed:
    """Return the data of the page that ``bioscara view`` with these words opens."""
    return viewed_from(parse(["view", *words.split()]), load_parameters())


def test_without_the_packages_of_the_page_the_error_names_them(
    monkeypatch: pytest.MonkeyPatch, said: Said
) -> None:
    monkeypatch.setattr("bioscara.cli.commands.serving.web.find_spec", lambda _: None)
    error = said.refusal("view")
    assert "pip install 'bioscara[web]'" in error


def test_it_serves_until_it_is_interrupted(start: Callable[..., subprocess.Popen[str]]) -> None:
    view = start("-m", "bioscara", "view", "--port", "0", cold=True)
    assert view.stdout is not None
    line = view.stdout.readline()
    address = r"the arm in 3D: (http://127\.0\.0\.1:\d+)/viewer\.html#token=(\w+) .*\n$"
    found = re.match(address, line)
    assert found
    with httpx.Client(base_url=found[1], headers={"Authorization": f"Bearer {found[2]}"}) as client:
        assert client.get("/viewer.html").status_code == 200
        shown = client.get("/api/viewed").json()
    assert (shown["motion"], shown["live"]) == (None, False)
    assert shown["positions"] == list(START)
    view.send_signal(signal.SIGINT)
    assert view.wait(timeout=20) == 0
    assert view.stdout.read() == ""


def test_a_served_arm_is_shown_by_a_gateway_that_may_only_look(
    start: Callable[..., subprocess.Popen[str]],
) -> None:
    with arm_served():
        view = start("-m", "bioscara", "view", f"arm:{NAME}", "--port", "0")
        assert view.stdout is not None
        found = re.search(r"(http://127\.0\.0\.1:\d+)/#token=(\w+) ", view.stdout.readline())
        assert found
        headers = {"Authorization": f"Bearer {found[2]}"}
        with httpx.Client(base_url=found[1], headers=headers) as client:
            assert client.get("/session").json()["scope"] == "view"
            assert client.get("/api/model").status_code == 200
            assert client.post("/api/parameters/check", json={}).status_code != 200
        assert page_of(NAME) is None
        assert not default_path(NAME).exists()
        view.send_signal(signal.SIGINT)
        assert view.wait(timeout=20) == 0


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with runs, and with every wrong kind of file."""
    monkeypatch.chdir(tmp_path)
    lines = [header(NAMES), *(row(cycle(0.01 * index)) for index in range(50)), ""]
    whole = "\n".join(lines)
    contents = {
        "good": whole,
        "truncated": whole[:-20],
        "emptied": "",
        "begun": lines[0] + "\n",
        "runs/20260101-120000-old": whole,
    }
    for name, text in contents.items():
        (tmp_path / name).mkdir(parents=True)
        (tmp_path / name / "samples.csv").write_text(text)
    (tmp_path / "no-run").mkdir()
    (tmp_path / "good" / "report.txt").write_text("bioscara 0.1.0: demo\n  outcome completed\n")
    words = ["poses", "save", "plate", "--joints", "0.3", "0.1", "0.8", "-0.4"]
    assert main(words) == 0
    write_csv("a.csv", Trajectory(("j1", "j2"), [0.0, 1.0], [[0.0, 0.1], [0.2, 0.12]]))
    return tmp_path


def cycle(time: float) -> CycleRecord:
    joints = tuple(
        JointRecord(time, position, 0.0, position, 0.0, 0, SampleQuality.GOOD)
        for position in (time, 0.2, 0.9, -0.5)
    )
    return CycleRecord(Phase.TRAJECTORY, 7.0 + time, time, 0.004, 0, 0.0, joints)


@pytest.mark.parametrize(
    ("words", "last", "title"),
    [
        ("good", (0.49, 0.2, 0.9, -0.5), "run good"),
        ("a.csv", (0.2, 0.12), "a.csv"),
        ("--joints 0.3 0.1 0.8 -0.4", (0.3, 0.1, 0.8, -0.4), "plan"),
        ("--name plate --from 0 0.2 0.5 0", (0.3, 0.1, 0.8, -0.4), "plan"),
    ],
)
@pytest.mark.usefixtures("files")
def test_a_motion_is_played(words: str, last: tuple[float, ...], title: str) -> None:
    shown = viewed(words)
    assert shown.title == title
    assert shown.motion is not None
    assert shown.motion.joint_names == NAMES[: len(last)]
    assert shown.motion.positions[-1] == pytest.approx(last)
    assert any(note.startswith("least clearance ") for note in shown.notes)


@pytest.mark.usefixtures("files")
def test_a_run_has_its_times_and_the_parts_they_belong_to() -> None:
    shown = viewed("good")
    assert shown.motion is not None
    assert shown.motion.times == pytest.approx([0.01 * index for index in range(50)])
    assert shown.phases == ((0.0, "trajectory"),)


@pytest.mark.usefixtures("files")
def test_a_trajectory_of_some_joints_says_which_are_missing() -> None:
    shown = viewed("a.csv")
    assert any("where j3, j4 is: shown at a chosen position" in note for note in shown.notes)
    assert shown.positions == START


def test_the_scene_and_the_tool_of_a_plan_are_shown() -> None:
    shown = viewed(f"--pose 0.45 -0.2 0.25 0 --scene {EXAMPLE}")
    scene = read_scene(EXAMPLE)
    assert [each.zone.name for each in shown.workspace.scene.zones] == [
        zone.name for zone in scene.zones
    ]
    assert shown.workspace.scene.table_height == scene.table_height
    assert shown.workspace.tool.name == "fingers"


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        ("none.csv", "none.csv: does not exist"),
        ("good/report.txt", "good/report.txt: "),
        ("good/samples.csv", "name its folder: bioscara view good"),
        ("poses.yaml", "bioscara move --name NAME --table poses.yaml"),
        ("runs", "name one in it, such as the last: bioscara view runs/20260101-120000-old"),
        ("no-run", "no-run is not the folder of a run"),
        ("truncated", "truncated/samples.csv, line 51: the line is truncated; delete it"),
        ("emptied", "emptied/samples.csv, line 1: the line is truncated"),
        ("begun", "ended before the position of every joint was known"),
        ("sim:/no/such.sock", "bioscara simulate --socket /no/such.sock"),
        ("sim", "or as sim:/path.sock"),
        ("linux:1", "or as sim:/path.sock"),
        ("arm:nobody", "no owner of arm nobody runs"),
        ("--joints 9 9 9 9", "--joints, j1"),
        ("--pose 9 9 0 0", "cannot be reached"),
        ("--name palte", "did you mean plate?"),
    ],
)
@pytest.mark.usefixtures("files")
def test_a_source_that_cannot_be_shown_is_refused_in_one_sentence(
    words: str, complaint: str, said: Said
) -> None:
    err = said.refusal(f"view --port 0 {words}")
    assert complaint in err


@pytest.mark.usefixtures("files")
def test_a_trajectory_that_run_refuses_is_shown_with_the_reason() -> None:
    write_csv("fast.csv", Trajectory(NAMES, [0.0, 0.1], [START, (0.6, 0.2, 1.2, -0.6)]))
    shown = viewed("fast.csv")
    assert any("'bioscara run' refuses it: j1 at" in note for note in shown.notes)
    assert shown.motion is not None
    assert shown.motion.positions[-1] == pytest.approx((0.6, 0.2, 1.2, -0.6))


@pytest.mark.usefixtures("files")
def test_a_trajectory_of_another_arm_is_refused(said: Said) -> None:
    write_csv("other.csv", Trajectory(("j9",), [0.0, 1.0], [[0.0], [0.2]]))
    assert "j9 is not a joint of the arm; it has j1, j2, j3, j4" in said.refusal(
        "view --port 0 other.csv"
    )


@pytest.mark.parametrize("name", ["poses.yaml", "saved.txt"])
@pytest.mark.usefixtures("files")
def test_a_teach_table_that_is_run_is_recognised(name: str, said: Said) -> None:
    Path("poses.yaml").rename(name)
    assert said.refusal("run", name) == (
        f"bioscara: {name}: is a table of named poses and holds no trajectory; move to one of its "
        f"poses with 'bioscara move --name NAME --table {name}'\n"
    )


def test_a_scene_that_is_run_is_recognised(said: Said) -> None:
    assert f"give it as --scene {EXAMPLE}" in said.refusal("run", str(EXAMPLE))
    world = EXAMPLE.with_name("world.yaml")
    assert f"give it as --world {world}" in said.refusal("run", str(world))


def test_a_scene_that_cannot_be_read_is_refused(said: Said) -> None:
    err = said.refusal("view --port 0 --scene none.yaml")
    assert "none.yaml: No such file" in err


def test_the_scene_of_a_served_arm_is_its_own(said: Said) -> None:
    for word in ("--scene", "--world"):
        assert f"{word}: arm:left is shown in the scene of its owner" in said.refusal(
            f"view --port 0 arm:left {word}", str(EXAMPLE)
        )
