"""The observer shows and records in its own thread, and a failure of either delays no motion."""

from __future__ import annotations

import io
import math
import os
import pty
import resource
import signal
import sys
from pathlib import Path
from typing import Any

import pytest

from bioscara.cli.output.console import Output
from bioscara.cli.output.display import PlainView, make_view
from bioscara.cli.output.live_table import TableView
from bioscara.cli.output.live_view import state_word
from bioscara.cli.output.observer import Observer
from bioscara.cli.signals import StopRequest
from bioscara.protocol import Flags
from bioscara.report import CycleHistory, CycleRecord, JointRecord, Phase, SampleQuality
from bioscara.report.sample_file import SampleWriter

JOINTS = (("j1", "rad"), ("j2", "m"))


def joint(**changes: Any) -> JointRecord:
    return JointRecord(0.5, 0.1, 0.0, 0.1234, 0.01, 0, SampleQuality.GOOD, 7.0)._replace(**changes)


def cycle(index: int = 0, **changes: Any) -> CycleRecord:
    return CycleRecord(
        Phase.TRAJECTORY, index * 0.01, index * 0.01, 0.004, 0, 0.0, (joint(**changes), joint())
    )


def observe(path: Path, count: int, view: PlainView) -> tuple[Observer, CycleHistory]:
    history = CycleHistory(("j1", "j2"))
    samples = SampleWriter(path, history.joint_names)
    with Observer(view, samples, history) as observer:
        for index in range(count):
            observer.cycle(cycle(index))
    samples.close()
    return observer, history


def test_every_cycle_is_stored_and_written(tmp_path: Path) -> None:
    observer, history = observe(tmp_path / "samples.csv", 500, PlainView(Output(), JOINTS))
    assert observer.problem == ""
    assert len(history) == 500
    assert len((tmp_path / "samples.csv").read_text().splitlines()) == 501


def test_the_line_of_homing_names_the_joint_that_moves_and_the_share(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    view = PlainView(Output(), JOINTS)
    moving = CycleRecord(
        Phase.HOMING, 12.0, math.nan, 0.004, 0, 0.0, (joint(), joint(flags=Flags.BUSY)), 0.345
    )
    with Observer(view) as observer:
        observer.cycle(moving)
    assert capsys.readouterr().out.startswith("  homing j2  34%   12.00 s | j1 ")


def test_a_full_disk_is_reported_once_and_the_history_stays_complete(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, limits[1]))
    try:
        observer, history = observe(tmp_path / "samples.csv", 500, PlainView(Output(), JOINTS))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert "File too large" in observer.problem
    assert len(history) == 500
    assert capsys.readouterr().out.count("recording stopped, the motion goes on") == 1
    assert (tmp_path / "samples.csv").read_text().endswith("\n")


class Gone(io.StringIO):
    def write(self, _: str) -> int:
        raise BrokenPipeError(32, "Broken pipe")


@pytest.mark.parametrize("view_type", [PlainView, TableView])
def test_a_closed_pipe_stops_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, view_type: type[PlainView]
) -> None:
    output = Output()
    view = view_type(output, JOINTS, interval=0.0)
    monkeypatch.setattr(sys, "stdout", Gone())
    observer, history = observe(tmp_path / "samples.csv", 50, view)
    assert observer.problem == ""
    assert len(history) == 50
    with pytest.raises(BrokenPipeError):
        output.check()


def test_plain_lines_come_at_their_interval_and_end_with_the_last_state(
    capsys: pytest.CaptureFixture[str],
) -> None:
    view = PlainView(Output(), JOINTS, interval=3600.0)
    view.phase("following the trajectory")
    for index in range(100):
        view.cycle(cycle(index))
    view.close()
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "following the trajectory"
    assert len(lines) == 3
    assert "trajectory    0.99 s" in lines[-1]
    assert "j1 moving +0.1234 rad +0.0100 rad/s 7 %" in lines[-1]


def test_a_terminal_gets_the_table(monkeypatch: pytest.MonkeyPatch) -> None:
    ours, theirs = pty.openpty()
    monkeypatch.setenv("TERM", "xterm")
    with os.fdopen(theirs, "w") as terminal:
        monkeypatch.setattr(sys, "stdout", terminal)
        view = make_view(Output(), JOINTS)
        assert isinstance(view, TableView)
        view.cycle(cycle())
        view.close()
        terminal.flush()
        shown = ""
        # A terminal returns the bytes it has, not all that are coming.
        while "moving" not in shown:
            shown += os.read(ours, 100_000).decode()
    os.close(ours)
    assert "+0.1234 rad" in shown
    assert "moving" in shown


@pytest.mark.parametrize(
    ("changes", "phase", "word"),
    [
        ({"flags": Flags.STALL | Flags.NOTENABLED}, Phase.TRAJECTORY, "STALLED"),
        ({"flags": Flags.FAULT | Flags.NOTENABLED}, Phase.TRAJECTORY, "FAULT"),
        ({"flags": Flags.NOTENABLED}, Phase.TRAJECTORY, "disabled"),
        ({"flags": Flags.NOTHOMED}, Phase.HOMING, "not homed"),
        ({"flags": Flags.NOTHOMED | Flags.BUSY}, Phase.HOMING, "homing"),
        ({"flags": 0}, Phase.HOMING, "homed"),
        ({"velocity": 0.0}, Phase.TRAJECTORY, "holding"),
        ({"quality": SampleQuality.STALE}, Phase.TRAJECTORY, "no answer"),
    ],
)
def test_a_state_has_one_word(changes: dict[str, object], phase: Phase, word: str) -> None:
    assert state_word(joint(**changes), phase, "rad") == word


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_every_signal_is_only_a_stop_request(number: signal.Signals) -> None:
    before = signal.getsignal(number)
    with StopRequest() as interruption:
        assert not interruption()
        os.kill(os.getpid(), number)
        os.kill(os.getpid(), number)
        assert interruption()
    assert signal.getsignal(number) is before
