"""The service of an arm: installed into a root, judged by systemd, and run as by its unit."""

from __future__ import annotations

import configparser
import os
import shlex
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from subprocess import Popen

import pytest

from bioscara import Robot
from bioscara.cli.parser import parse
from bioscara.service import files
from cli.said import Said

PYTHON = "/opt/bioscara/bin/python"
OVERLAY = "joints: {j1: {reduction: 35.2}}\n"
SHARED = (
    "etc/systemd/system/bioscara@.service",
    "etc/sysusers.d/bioscara.conf",
    "etc/tmpfiles.d/bioscara.conf",
    "etc/udev/rules.d/70-bioscara-devices.rules",
    "etc/udev/rules.d/70-bioscara-flash.rules",
)


@pytest.fixture
def said(capsys: pytest.CaptureFixture[str]) -> Said:
    return Said(capsys)


@pytest.fixture
def root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty root of another computer, in which bioscara has its usual place."""
    monkeypatch.setattr(sys, "executable", PYTHON)
    made = tmp_path / "root"
    python = made / PYTHON[1:]
    python.parent.mkdir(parents=True)
    python.touch(0o755)
    return made


def all_files(root: Path) -> dict[str, str]:
    return {
        str(path.relative_to(root)): path.read_text()
        for path in sorted(root.rglob("*"))
        if path.is_file() and path.name != "python"
    }


def settings(root: Path) -> configparser.SectionProxy:
    read = configparser.ConfigParser(interpolation=None, strict=False)
    read.optionxform = str  # type: ignore[assignment,method-assign]
    read.read(root / SHARED[0])
    return read["Service"]


def options(root: Path, name: str = "left") -> list[str]:
    return files.read_options(root, name) or []


def judged(*words: str) -> str:
    """Return what a program of systemd says, which has to be content."""
    if shutil.which(words[0]) is None:
        pytest.skip(f"{words[0]} is missing: it comes with systemd")
    ended = subprocess.run(words, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
    return ended.stdout + ended.stderr


def test_systemd_verifies_the_installed_unit_and_makes_its_users(said: Said, root: Path) -> None:
    said.output(f"service install left --root {root} --with web")
    users, groups = root / "etc/passwd", root / "etc/group"
    users.touch()
    groups.touch()
    judged("systemd-sysusers", f"--root={root}")
    made = {line.split(":")[0] for line in groups.read_text().splitlines()}
    assert made >= {"bioscara", "i2c", "gpio", "plugdev"}
    assert "bioscara" in users.read_text()
    unit = root / "bioscara@left.service"
    unit.write_text((root / SHARED[0]).read_text().replace(PYTHON, "/bin/sh"))
    assert judged("systemd-analyze", "verify", str(unit)) == ""
    security = judged("systemd-analyze", "security", "--offline=true", str(unit))
    assert float(security.rpartition(": ")[2].split()[0]) < 3.0


def test_the_unit_grants_what_the_owner_uses(said: Said, root: Path) -> None:
    said.output(f"service install left --root {root}")
    unit = settings(root)
    served = parse(("serve", *options(root)))
    assert (served.bus, served.priority) == ("linux:1", 80)
    assert int(unit["LimitRTPRIO"]) >= 99
    assert unit["LimitMEMLOCK"] == "infinity"
    assert {"i2c", "gpio"} <= set(unit["SupplementaryGroups"].split())
    assert unit["EnvironmentFile"] == "/etc/bioscara/%i.env"
    assert unit["KillMode"] == "mixed"


@pytest.mark.parametrize("at_once", [True, False])
def test_when_it_reports_ready_clients_can_connect_and_its_loop_feeds_the_watchdog(
    said: Said,
    root: Path,
    start: Callable[..., Popen[str]],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    at_once: bool,
) -> None:
    overlay = tmp_path / "mine.yaml"
    overlay.write_text(OVERLAY)
    name = f"service-{at_once}"
    said.output(f"service install {name} --root {root} --bus sim --parameters {overlay}")
    monkeypatch.undo()
    # As systemd reads it, without a group that this computer need not have, in the test's folder.
    line = settings(root)["ExecStart"].replace("%i", name)
    line = line.replace("$BIOSCARA_OPTIONS", shlex.join(options(root, name)))
    line = line.replace(" --group bioscara", "")
    program, *words = shlex.split(line.replace("/var/lib", f"{root}/var/lib"))
    assert program == PYTHON
    path = f"{os.environ['BIOSCARA_RUNTIME']}/notify-{at_once}"
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(path)
        systemd.settimeout(20.0)
        environment = {
            **os.environ,
            "NOTIFY_SOCKET": path,
            "WATCHDOG_USEC": "1000000",
            "STATE_DIRECTORY": str(tmp_path),
            "PYTHONSAFEPATH": "1",
        }
        service = start(*words, cold=True, env=environment, cwd=tmp_path, stdout=subprocess.PIPE)
        assert systemd.recv(100) == b"READY=1"
        if not at_once:
            with Robot.connect(f"arm:{name}") as robot:
                assert not robot.is_homed
                assert robot.parameters.joints[0].reduction == 35.2
            assert [systemd.recv(100) for _ in range(4)] == [b"WATCHDOG=1"] * 4
        service.send_signal(signal.SIGTERM)
        assert service.wait(20) == 0
        said_at_start = service.stdout.read() if service.stdout else ""
    state = root / "var/lib/bioscara" / name
    assert f"parameters: {state}/parameters.yaml changes joints.j1.reduction" in said_at_start
    if not at_once:
        assert f"table: {state}/poses.yaml\nscene: none\n" in said_at_start


def test_a_second_installation_changes_what_is_given_and_keeps_what_a_person_wrote(
    said: Said, root: Path, tmp_path: Path
) -> None:
    said.output(f"service install left --root {root} --with web")
    first = all_files(root)
    assert set(first) == {*SHARED, "etc/bioscara/left.env"}
    assert "6 files are up to date" in said.output(f"service install left --root {root}")
    assert all_files(root) == first
    environment = root / "etc/bioscara/left.env"
    environment.write_text(
        environment.read_text().replace("--priority 80", "--priority 70 --rate=50") + "FOO=bar\n"
    )
    (mine := tmp_path / "mine.yaml").write_text(OVERLAY)
    command = f"service install left --root {root} --bus linux:2 --parameters"
    written = said.output(command, str(mine))
    kept = "--priority 70 --rate=50 --table /var/lib/bioscara/left/poses.yaml --with web"
    assert f"kept from {environment}: {kept}\n" in written
    assert environment.read_text().endswith("--with web\nFOO=bar\n")
    served = parse(("serve", *options(root)))
    assert (served.bus, served.priority, served.rate) == ("linux:2", 70, 50)
    copy = root / "var/lib/bioscara/left/parameters.yaml"
    assert (str(served.parameters), copy.read_text()) == (f"/{copy.relative_to(root)}", OVERLAY)
    mine.write_text(OVERLAY.replace("35.2", "35.3"))
    said.output(command, str(mine))
    assert copy.with_name("parameters.yaml.bak").read_text() == OVERLAY
    assert copy.read_text() == mine.read_text()


def test_what_is_removed_and_what_is_kept_and_used_again(
    said: Said, root: Path, tmp_path: Path
) -> None:
    (mine := tmp_path / "mine.yaml").write_text(OVERLAY)
    said.output(f"service install left --root {root} --parameters", str(mine))
    said.output(f"service install right --root {root}")
    wanted = root / "etc/systemd/system/multi-user.target.wants/bioscara@left.service"
    wanted.parent.mkdir()
    wanted.symlink_to("/etc/systemd/system/bioscara@.service")
    before = all_files(root)
    assert "would remove" in said.output(f"service uninstall left --root {root} --dry-run")
    assert all_files(root) == before
    state = root / "var/lib/bioscara/left"
    assert f"kept: {state} with" in said.output(f"service uninstall left --root {root}")
    assert not wanted.is_symlink()
    assert set(before) - set(all_files(root)) == {"etc/bioscara/left.env"}
    said.output(f"service uninstall right --root {root}")
    assert all_files(root) == {f"{state.relative_to(root)}/parameters.yaml": OVERLAY}
    assert not (root / "etc/bioscara").exists()
    said.output(f"service install left --root {root}")
    assert "--parameters" in options(root)


def test_a_dry_run_prints_each_file_and_command_and_changes_nothing(
    said: Said, root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written = said.output(f"service install left --dry-run --root {root}")
    assert [f"would write {root / path}" for path in SHARED] == written.splitlines()[1:6]
    assert all_files(root) == {}
    monkeypatch.setattr(files, "_HIDDEN", ())
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    for program in ("systemd-sysusers", "udevadm control", "systemctl enable --now"):
        assert f"would run {program}" in said.output("service install left --dry-run")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("install 1x", "'1x' is no name of an arm"),
        ("install left --parameters none.yaml", "none.yaml: No such file"),
        ("install left --parameters BAD", "reductoin"),
        ("install left --scene none.yaml", "none.yaml: No such file"),
        ("install left --table BAD", "the file is truncated"),
        ("install left --bus can0", "no bus is named 'can0'"),
        ("install left --with wep", "did you mean web?"),
        ("install left --with 'web --host $X'", "has '$', which systemd"),
        ("uninstall left", "no service of arm left is installed"),
    ],
)
def test_a_wrong_installation_is_refused_in_a_sentence_and_leaves_nothing(
    said: Said, root: Path, tmp_path: Path, words: str, message: str
) -> None:
    (bad := tmp_path / "bad.yaml").write_text("joints: {j1: {reductoin: 35.2}}\n")
    assert message in said.failure(f"service {words.replace('BAD', str(bad))} --root {root}")
    assert all_files(root) == {}


def test_a_file_of_another_program_is_left_alone(said: Said, root: Path) -> None:
    unit = root / SHARED[0]
    unit.parent.mkdir(parents=True)
    unit.write_text("[Service]\n")
    refusal = said.failure(f"service install left --root {root}")
    assert f"{unit} was not written by bioscara service install" in refusal
    assert all_files(root) == {SHARED[0]: "[Service]\n"}


def test_a_file_that_cannot_be_written_leaves_all_as_they_were(said: Said, root: Path) -> None:
    unit, blocked = root / SHARED[0], root / "etc/udev"
    said.output(f"service install left --root {root}")
    shutil.rmtree(blocked)
    blocked.touch()
    unit.write_text(former := unit.read_text().replace("MemoryMax=1G", "MemoryMax=2G"))
    (root / SHARED[1]).unlink()
    refusal = said.failure(f"service install left --root {root}")
    assert "70-bioscara-devices.rules cannot be written" in refusal
    assert unit.read_text() == former
    assert set(all_files(root)) == {SHARED[0], SHARED[2], "etc/bioscara/left.env", "etc/udev"}


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("--bus sim --parameters /home/pi/mine.yaml", "/home/pi/mine.yaml is hidden from services"),
        ("--bus sim --prioritee 80", "did you mean --priority?"),
        ("--bus sim --with 'web", "BIOSCARA_OPTIONS cannot be read"),
        ("--bus sim --scene mine.yaml", "/var/lib/bioscara/left/mine.yaml: No such file"),
    ],
)
def test_options_that_a_person_wrote_are_checked(
    said: Said, root: Path, line: str, message: str
) -> None:
    said.output(f"service install left --root {root}")
    (root / "etc/bioscara/left.env").write_text(f"BIOSCARA_OPTIONS={line}\n")
    assert message in said.failure(f"service install left --root {root}")


def test_rights_systemd_and_a_place_that_services_can_read_are_required(
    said: Said, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "executable", "/home/pi/.venv/bin/python")
    hidden = said.refusal("service install left --dry-run")
    assert "/home/pi/.venv/bin/python, which is hidden from services; install it" in hidden
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    for action in ("install", "uninstall"):
        refusal = said.refusal(f"service {action} left")
        assert f"only root may {action} a service; nothing has changed: sudo" in refusal
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    if not Path("/run/systemd/system").exists():
        assert "systemd does not run this computer" in said.refusal("service install left")
    if not Path("/etc/bioscara/none.env").exists():
        assert "no service of arm none is installed" in said.refusal("service status none")
    assert "--root /none is no folder" in said.refusal("service install left --root /none")
