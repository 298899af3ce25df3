"""``bioscara view`` from a terminal."""

from __future__ import annotations

import importlib.util
import os
import re
import signal
import subprocess
import sys
import threading
import time
import urllib.request
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from bioscara.cli import main
from bioscara.cli.shared_arguments import START
from bioscara.cli.view_source import look_at
from bioscara.errors import BusUnavailableError
from bioscara.model import load_parameters
from bioscara.planning import Trajectory, write_csv
from bioscara.planning.collision.scene import Scene
from bioscara.planning.files.scene_file import read_scene
from bioscara.report import CycleRecord, JointRecord, Phase, SampleQuality
from bioscara.report.samples import header, row
from bioscara.robot import kinematics_of
from cli.commands.pictures import expected
from served import NAME, arm_served

NAMES = ("j1", "j2", "j3", "j4")
EXAMPLE = Path(__file__).parents[4] / "examples" / "scene.yaml"
needs_viser = pytest.mark.skipif(
    importlib.util.find_spec("viser") is None, reason="needs bioscara[view]"
)


def test_without_viser_the_error_names_the_package(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "viser", None)
    monkeypatch.delitem(sys.modules, "bioscara.viewer.page", raising=False)
    assert main(["view"]) == 2
    error = capsys.readouterr().err
    assert "pip install 'bioscara[view]'" in error
    assert len(error.splitlines()) == 1


@needs_viser
def test_it_serves_until_it_is_interrupted(start: Callable[..., subprocess.Popen[str]]) -> None:
    view = start("-m", "bioscara", "view", "--port", "0", cold=True)
    assert view.stdout is not None
    found = re.match(r"the arm in 3D: (http://127\.0\.0\.1:\d+) .*\n$", view.stdout.readline())
    assert found
    with urllib.request.urlopen(found[1]) as answer:
        assert answer.status == 200
    view.send_signal(signal.SIGINT)
    assert view.wait(timeout=20) == 0
    assert view.stdout.read() == ""


@pytest.mark.parametrize("port", ["-1", "65536", "http"])
def test_a_wrong_port_is_refused(port: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["view", "--port", port])
    assert "is not a port" in capsys.readouterr().err


def look(
    words: list[str],
    moves: Mapping[str, float],
    monkeypatch: pytest.MonkeyPatch,
    ready: Callable[[], bool] = lambda: True,
) -> tuple[int, dict[str, float]]:
    """Show the arm, move sliders, and press Ctrl-C; return status and where the sliders began."""
    from bioscara.viewer import page as module  # noqa: PLC0415

    pages = []

    class Seen(module.Page):
        @property
        def url(self) -> str:
            # Read once the command has taken the positions where the motion begins.
            pages.append((self, dict(self.positions)))
            return super().url

    monkeypatch.setattr(module, "Page", Seen)

    def person() -> None:
        deadline = time.monotonic() + 20.0
        while not pages or not ready() or signal.getsignal(signal.SIGINT) is before:
            if time.monotonic() > deadline:
                return
            time.sleep(0.01)
        for joint, position in moves.items():
            pages[0][0].show({joint: position})
        os.kill(os.getpid(), signal.SIGINT)

    before = signal.getsignal(signal.SIGINT)
    thread = threading.Thread(target=person)
    thread.start()
    status = main(["view", "--port", "0", *words])
    thread.join()
    return status, pages[0][1]


@needs_viser
@pytest.mark.parametrize(
    ("moves", "scene"),
    [({"j1": -0.4, "j4": 0.3, "gripper": 0.1}, EXAMPLE), ({}, None)],
    ids=["moved in a scene", "not moved, alone"],
)
def test_the_motion_of_the_sliders_is_drawn(
    moves: dict[str, float],
    scene: Path | None,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pytest.importorskip("matplotlib")
    picture = tmp_path / "view.png"
    words = ["--plot", str(picture), *(["--scene", str(scene)] if scene else [])]
    status, began = look(words, moves, monkeypatch)
    out, err = capsys.readouterr()
    assert (status, err) == (0, "")
    assert out.endswith(f"wrote {picture}\n")
    names = [joint.name for joint in load_parameters().joints]
    start = [began[name] for name in names]
    goal = [{**began, **moves}[name] for name in names]
    around = read_scene(scene) if scene else None
    assert picture.read_bytes() == expected(tmp_path, start, goal, "view", around)


@needs_viser
def test_a_motion_of_the_sliders_through_a_zone_is_not_drawn(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("matplotlib")
    picture = tmp_path / "view.png"
    words = ["--plot", str(picture), "--scene", str(EXAMPLE)]
    status, _ = look(words, {"j1": 1.5}, monkeypatch)
    assert status == 2
    assert re.search(r"comes too near to plate reader from .* mm inside", capsys.readouterr().err)
    assert not picture.exists()


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


@needs_viser
@pytest.mark.parametrize(
    ("words", "last", "title"),
    [
        ("good", (0.49, 0.2, 0.9, -0.5), "run good"),
        ("a.csv", (0.2, 0.12, *START[2:]), "a.csv"),
        ("--joints 0.3 0.1 0.8 -0.4", (0.3, 0.1, 0.8, -0.4), "plan"),
        ("--name plate --from 0 0.2 0.5 0", (0.3, 0.1, 0.8, -0.4), "plan"),
    ],
)
@pytest.mark.usefixtures("files")
def test_a_motion_is_played(
    words: str,
    last: tuple[float, ...],
    title: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from bioscara.viewer.player import Player  # noqa: PLC0415

    seen = []
    before = Player.step

    def step(player: Player, now: float) -> None:
        seen.append(player)
        before(player, now)

    monkeypatch.setattr(Player, "step", step)
    capsys.readouterr()
    status, _ = look(words.split(), {}, monkeypatch, lambda: bool(seen))
    assert (status, capsys.readouterr().err) == (0, "")
    recording = seen[0]._recording
    assert recording.title == title
    assert recording.at(recording.end) == pytest.approx(last)


@needs_viser
def test_a_served_arm_is_shown() -> None:
    with arm_served() as served:
        look_at_it = look_at(f"arm:{NAME}")
        time, joints = look_at_it()
        assert joints == pytest.approx(served.robot.state.positions, abs=1e-3)
        assert time <= served.robot.state.time
    with pytest.raises(BusUnavailableError):
        look_at_it()


@needs_viser
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
    words: str, complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    assert main(["view", "--port", "0", *words.split()]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert complaint in err
    assert len(err.splitlines()) == 1


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        ("good --name plate", "exclude one another"),
        ("good --plot a.png", "--plot of view draws the motion of the sliders"),
        ("--name plate --plot a.png", "--plot of view draws the motion of the sliders"),
        ("--linear", "--linear applies to a planned motion; add --pose"),
        ("good --from 0 0.2 0 0", "--from applies to a planned motion"),
        ("a.csv --velocity-scaling 0.5", "--velocity-scaling applies to a planned motion"),
    ],
)
def test_options_that_would_be_ignored_are_refused(
    words: str, complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        main(["view", *words.split()])
    assert complaint in capsys.readouterr().err


@needs_viser
def test_a_trajectory_that_run_refuses_is_shown_with_the_reason(
    files: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from bioscara.cli.view_source import of_trajectory  # noqa: PLC0415

    parameters = load_parameters()
    fast = Trajectory(NAMES, [0.0, 0.1], [START, (0.6, 0.2, 1.2, -0.6)])
    arm = kinematics_of(parameters)
    recording = of_trajectory("fast", fast, (), parameters, Scene(), arm)
    assert any("'bioscara run' refuses it: j1 at" in note for note in recording.notes)
    assert recording.at(0.1) == pytest.approx((0.6, 0.2, 1.2, -0.6))


@pytest.mark.parametrize("name", ["poses.yaml", "saved.txt"])
@pytest.mark.usefixtures("files")
def test_a_teach_table_that_is_run_is_recognised(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("poses.yaml").rename(name)
    capsys.readouterr()
    assert main(["run", name]) == 2
    assert capsys.readouterr().err == (
        f"bioscara: {name}: is a table of named poses and holds no trajectory; move to one of its "
        f"poses with 'bioscara move --name NAME --table {name}'\n"
    )


def test_a_scene_that_is_run_is_recognised(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", str(EXAMPLE)]) == 2
    assert f"give it as --scene {EXAMPLE}" in capsys.readouterr().err


@needs_viser
@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        ("--scene none.yaml", "none.yaml: No such file"),
        ("--plot nowhere/a.png", "there is no folder nowhere"),
    ],
)
def test_a_view_that_cannot_be_shown_or_written_is_refused_at_once(
    words: str, complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("matplotlib")
    assert main(["view", "--port", "0", *words.split()]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert complaint in err
    assert len(err.splitlines()) == 1
