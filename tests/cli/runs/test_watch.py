"""``bioscara demo --watch``: the simulated arm with its page, until Ctrl-C."""

from __future__ import annotations

import os
import re
import signal
import stat
import threading
from collections.abc import Callable
from pathlib import Path
from subprocess import Popen

import httpx
import pytest

from bioscara import Joints, Robot
from bioscara.api import messages as m
from bioscara.api.gateway_pages import page_of
from bioscara.api.runtime import find, folder, owners
from bioscara.cli import main
from bioscara.cli.output.console import ExitStatus
from bioscara.cli.runs import job, watch
from bioscara.control.loop.realtime import realtime
from bioscara.errors import RealtimeError
from bioscara.remote import RemoteRobot
from bioscara.robot.workspace.poses import NamedPose
from cli.said import Said
from programs import environment, wait_for_line, wait_until
from served import RawClient, runtime_folder


def test_it_moves_the_served_arm_and_opens_its_page_without_a_token_in_arguments(
    start: Callable[..., Popen[str]], tmp_path: Path
) -> None:
    browser = tmp_path / "browser"
    browser.write_text(f'#!/bin/sh\necho "$1" >{tmp_path}/given\n')
    browser.chmod(0o700)
    with runtime_folder():
        settings = environment(BROWSER=f"{browser} %s")
        words = ("-m", "bioscara", "demo", "--watch", "--out", str(tmp_path / "run"))
        process = start(*words, env=settings)
        given = tmp_path / "given"
        wait_until(lambda: given.exists() and given.read_text() != "", "it is opened", 60.0)
        address = given.read_text().strip()
        assert address == (folder() / "demo.open.html").as_uri()
        path = Path(address.removeprefix("file://"))
        assert stat.S_IMODE(path.stat().st_mode) == 0o600
        found = re.search(r"url=(http://127\.0\.0\.1:\d+/)#token=[0-9a-f]{32}\"", path.read_text())
        assert found is not None
        assert httpx.get(found[1]).status_code == 200
        with Robot.connect("arm:demo") as robot:
            wait_until(
                lambda: max(map(abs, robot.state.velocities)) > 0.01, "it moves the arm", 30.0
            )
        process.send_signal(signal.SIGINT)
        said, _ = process.communicate(timeout=60.0)
        assert process.returncode == ExitStatus.INTERRUPTED
        assert f"the simulated arm in the browser: {found[1]}\n" in said
        assert re.search(r"token=\w", said) is None
        assert owners() == []
        assert page_of("demo") is None
        assert not path.exists()


def test_afterwards_it_serves_until_ctrl_c(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("PYTHONPATH", environment()["PYTHONPATH"])
    monkeypatch.chdir(tmp_path)
    for name in watch._SCREENS:
        monkeypatch.delenv(name, raising=False)
    Path("mine.yaml").write_text("geometry: {tool_x: 0.13}\n")
    seen: list[object] = []

    def demonstrated(_: object, __: object, options: object, ___: object) -> ExitStatus:
        seen.append(options.arm)  # type: ignore[attr-defined]
        with Robot.connect("arm:demo") as robot:
            assert isinstance(robot, RemoteRobot)
            robot.table = robot.table.with_pose(NamedPose("bench", Joints(0.1, 0.2, 0.3, 0.4)))
        with RawClient(path=find("demo").socket) as client:
            seen.append(client.request(m.GetParameters()).overlay)
        threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
        return ExitStatus.OK

    monkeypatch.setattr(job, "run_job", demonstrated)
    with runtime_folder():
        assert main(["demo", "--watch", "--parameters", "mine.yaml"]) == ExitStatus.OK
        assert not (folder() / "demo.open.html").exists()
    # The file of the parameters and that of the poses are those of the owner.
    assert seen == ["demo", "geometry: {tool_x: 0.13}\n"]
    assert "bench" in Path("poses.yaml").read_text()
    said = capsys.readouterr().out
    assert re.search(r"in the browser: http://127\.0\.0\.1:\d+/\n", said)
    assert "served until Ctrl-C; take control in the browser" in said
    assert re.search(r"token=\w", said) is None


def test_the_priority_is_that_of_the_control_loop(
    start: Callable[..., Popen[str]], tmp_path: Path
) -> None:
    try:
        with realtime():
            pass
    except RealtimeError as error:
        pytest.skip(str(error))
    with runtime_folder():
        process = start("-m", "bioscara", "demo", "--watch", "--priority", "70", cwd=tmp_path)
        wait_for_line(process, "taking the plate")
        threads = [int(path.name) for path in Path(f"/proc/{process.pid}/task").iterdir()]
        urgent = [each for each in threads if os.sched_getparam(each).sched_priority == 70]
        assert len(urgent) == 1
        assert urgent != [process.pid]
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60.0)


def test_another_arm_than_the_simulated_one_is_refused(said: Said) -> None:
    assert "bioscara serve --bus linux:1 --with web" in said.refusal(
        "demo --watch --bus linux:1", status=ExitStatus.REFUSED
    )
