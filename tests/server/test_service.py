"""The unit for systemd, run as systemd would as far as that can be done without it."""

from __future__ import annotations

import configparser
import os
import shlex
import signal
import socket
from collections.abc import Callable
from pathlib import Path
from subprocess import Popen

import pytest

from bioscara import Robot
from bioscara.cli.parser import parse

UNIT = Path(__file__).parents[2] / "examples/bioscara.service"
# systemd.unit(5), systemd.service(5), systemd.exec(5).
KNOWN = {
    "Unit": {"Description"},
    "Service": {
        "Type",
        "WatchdogSec",
        "Restart",
        "User",
        "RuntimeDirectory",
        "RuntimeDirectoryPreserve",
        "StateDirectory",
        "WorkingDirectory",
        "Environment",
        "ExecStart",
        "TimeoutStopSec",
        "LimitRTPRIO",
        "LimitMEMLOCK",
    },
    "Install": {"WantedBy"},
}


def unit() -> configparser.ConfigParser:
    read = configparser.ConfigParser(interpolation=None)
    read.optionxform = str  # type: ignore[assignment,method-assign]
    read.read(UNIT)
    return read


def test_its_settings_are_those_of_systemd_and_its_command_is_ours() -> None:
    settings = unit()
    assert {name: set(settings[name]) for name in settings.sections()} == KNOWN
    program, *words = shlex.split(settings["Service"]["ExecStart"])
    assert Path(program).name == "bioscara"
    options = parse(words)
    assert (options.command, options.bus, options.priority) == ("serve", "linux:1", 80)
    assert settings["Service"]["LimitRTPRIO"] == "80"
    assert settings["Service"]["Environment"] == "BIOSCARA_RUNTIME=/run/bioscara"


@pytest.mark.parametrize("at_once", [True, False])
def test_when_it_reports_ready_clients_can_connect_and_its_loop_feeds_the_watchdog(
    start: Callable[..., Popen[str]], tmp_path: Path, at_once: bool
) -> None:
    path = f"{os.environ['BIOSCARA_RUNTIME']}/notify-{at_once}"
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(path)
        systemd.settimeout(20.0)
        words = shlex.split(unit()["Service"]["ExecStart"])[1:]
        # The bus, the priority and the group are not those of this computer.
        command = [*words[:1], "--bus", "sim", "--name", "service"]
        environment = {**os.environ, "NOTIFY_SOCKET": path, "WATCHDOG_USEC": "1000000"}
        service = start("-m", "bioscara", *command, cold=True, env=environment, cwd=tmp_path)
        assert systemd.recv(100) == b"READY=1"
        if at_once:
            service.send_signal(signal.SIGTERM)
            assert service.wait(20) == 0
            return
        with Robot.connect("arm:service") as robot:
            assert not robot.is_homed
        fed = [systemd.recv(100) for _ in range(4)]
        assert fed == [b"WATCHDOG=1"] * 4
        service.send_signal(signal.SIGTERM)
        assert service.wait(20) == 0
