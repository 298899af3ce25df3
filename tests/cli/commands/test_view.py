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
from bioscara.model import load_parameters
from bioscara.planning.files.scene_file import read_scene
from cli.commands.pictures import expected

EXAMPLE = Path(__file__).parents[3] / "examples" / "scene.yaml"
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
@pytest.mark.realtime
def test_it_serves_until_it_is_interrupted(start: Callable[..., subprocess.Popen[str]]) -> None:
    view = start("-m", "bioscara", "view", "--port", "0")
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
    words: list[str], moves: Mapping[str, float], monkeypatch: pytest.MonkeyPatch
) -> tuple[int, dict[str, float]]:
    """Show the arm, move sliders, and press Ctrl-C; return status and where the sliders began."""
    from bioscara.viewer import page as module  # noqa: PLC0415

    pages = []

    class Seen(module.Page):
        def __init__(self, *arguments: object) -> None:
            super().__init__(*arguments)
            pages.append((self, dict(self.positions)))

    monkeypatch.setattr(module, "Page", Seen)

    def person() -> None:
        deadline = time.monotonic() + 20.0
        while not pages or signal.getsignal(signal.SIGINT) is before:
            if time.monotonic() > deadline:
                return
            time.sleep(0.01)
        for joint, position in moves.items():
            pages[0][0].move(joint, position)
        os.kill(os.getpid(), signal.SIGINT)

    before = signal.getsignal(signal.SIGINT)
    thread = threading.Thread(target=person)
    thread.start()
    status = main(["view", "--port", "0", *words])
    thread.join()
    return status, pages[0][1]


@needs_viser
@pytest.mark.parametrize("scene", [None, EXAMPLE], ids=["alone", "scene"])
@pytest.mark.parametrize(
    "moves", [{"j1": -0.4, "j4": 0.3, "gripper": 0.1}, {}], ids=["moved", "not"]
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
