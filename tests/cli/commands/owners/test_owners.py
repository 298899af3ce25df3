"""The commands about running owners, and those that use the arm of one."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from bioscara import Robot
from bioscara.__main__ import main as program
from bioscara.api import runtime
from bioscara.cli import main
from bioscara.errors import InvalidArgumentError
from bioscara.model import load_parameters
from bioscara.server.serve import Served, ServeSettings, serving
from served import runtime_folder


@pytest.fixture(scope="module")
def arm() -> Iterator[Served]:
    """An arm named left that is served 50 times as fast as real time."""
    with serving(Robot.simulated(), ServeSettings("left", "sim", real_time_factor=50.0)) as served:
        yield served


def said(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str, str]:
    status = main(words, paced=False)
    return status, *capsys.readouterr()


def test_arms_are_listed(arm: Served, capsys: pytest.CaptureFixture[str]) -> None:
    status, out, _ = said(capsys, "arms")
    assert status == 0
    assert re.search(rf"^left +sim +{os.getpid()} +disabled, not homed +nobody$", out, re.M)


def test_the_status_of_the_only_arm_needs_no_name(
    arm: Served, capsys: pytest.CaptureFixture[str]
) -> None:
    status, out, _ = said(capsys, "status")
    assert status == 0
    assert out.startswith("arm: left, simulation, in this process, version ")
    assert "commanded by: nobody" in out


def test_without_an_owner_there_is_no_status(capsys: pytest.CaptureFixture[str]) -> None:
    status, _, err = said(capsys, "status", "--arm", "right")
    assert status == 2
    assert "no owner of arm right runs" in err


def test_the_jaws_open_as_far_as_the_owner_has_them(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    overlay = tmp_path / "mine.yaml"
    overlay.write_text("gripper: {upper: 0.1}\n")
    monkeypatch.setenv("BIOSCARA_PARAMETERS", "elsewhere.yaml")
    served = ServeSettings("right", "sim", real_time_factor=50.0)
    with serving(Robot.simulated(load_parameters(overlay=overlay)), served) as arm:
        status, out, err = said(capsys, "gripper", "open", "--arm", "right")
        assert (status, err) == (0, "")
        assert arm.robot.gripper.width == pytest.approx(0.1)
        assert "parameters:" not in out


def test_commands_use_the_running_owner_and_say_so(
    arm: Served, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    status, out, err = said(capsys, "home")
    assert (status, err) == (0, "")
    assert "arm: arm left: simulation, in this process" in out
    assert arm.robot.is_homed
    # The arm stays enabled: its owner holds it.
    assert arm.robot.is_enabled
    monkeypatch.setenv("BIOSCARA_ARM", "left")
    status, out, err = said(capsys, "move", "--name", "center")
    assert (status, err) == (0, "")
    assert "--joints 0.0000 0.2000 0.0000 0.0000" in out
    status, _, err = said(capsys, "move", "--name", "gate")
    assert (status, "the owner of left has; --table FILE" in err) == (2, True)
    status, out, _ = said(capsys, "gripper", "0.06")
    assert (status, arm.robot.gripper.width) == (0, pytest.approx(0.06))
    status, out, _ = said(capsys, "gripper", "--servo-angle", "-60")
    assert "at this width the servo is at -60 deg" in out
    assert (status, arm.robot.gripper.width) == (0, pytest.approx(0.04))
    status, _, err = said(capsys, "gripper", "--servo-angle", "-61")
    assert (status, "-61 deg is outside -60 .. 180 deg; there the jaws" in err) == (2, True)
    for words in ((), ("open", "--servo-angle", "0")):
        assert said(capsys, "gripper", *words)[::2] == (
            2,
            "bioscara: gripper takes either a WIDTH or --servo-angle DEG\n",
        )
    status, out, _ = said(capsys, "joints", "--arm", "left")
    assert status == 0
    assert len(re.findall(r"^j\d +0x1\d +protocol 2, firmware \S+ +\S.* yes$", out, re.M)) == 4


def test_a_command_does_not_repeat_the_warnings_that_an_owner_had(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with serving(
        Robot.simulated(homed=True), ServeSettings("right", "sim", real_time_factor=50.0)
    ) as served:
        served.robot.unfold()
        served.robot.move_joints([-1.0, 0.1, 1.0, 0.0])
        assert served.robot.warnings
        status, out, _ = said(capsys, "move", "--joints", "1", "0.3", "1", "0", "--arm", "right")
        assert status == 0
        assert "warning" not in out


def test_the_owner_chooses_rate_and_firmware(
    arm: Served, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        main(["home", "--arm", "left", "--rate", "50"])
    assert "--rate is chosen by the owner of left; leave it out" in capsys.readouterr().err
    # An option that an owner cannot take is for an arm of this process.
    status, out, _ = said(capsys, "home", "--v1")
    assert (status, out.splitlines()[0]) == (
        0,
        "arm: simulation, in this process, joints with their original firmware; --arm left takes "
        "the served arm",
    )


def test_of_two_arms_on_one_bus_one_has_to_be_named(
    arm: Served, capsys: pytest.CaptureFixture[str]
) -> None:
    with serving(Robot.simulated(), ServeSettings("right", "sim", real_time_factor=50.0)):
        with pytest.raises(SystemExit):
            main(["home"])
        assert "there are the arms left, right; choose one with --arm NAME" in (
            capsys.readouterr().err
        )
        status, _, err = said(capsys, "status")
        assert status == 2
        assert "choose one with --arm NAME" in err
    assert [owner.name for owner in runtime.owners()] == ["left"]


def test_enable_and_disable_return_at_once(arm: Served, capsys: pytest.CaptureFixture[str]) -> None:
    status, out, _ = said(capsys, "enable", "--arm", "left")
    assert status == 0
    assert "enabled; left holds the joints until 'bioscara disable'" in out
    assert arm.robot.is_enabled
    assert said(capsys, "disable")[0] == 0
    assert not arm.robot.is_enabled


def test_events_and_log_are_listed(arm: Served, capsys: pytest.CaptureFixture[str]) -> None:
    status, out, _ = said(capsys, "events")
    assert status == 0
    numbers = [int(line.split()[0]) for line in out.splitlines()]
    assert numbers == list(range(1, numbers[-1] + 1))
    status, out, _ = said(capsys, "events", "--after", str(numbers[-1] - 2), "--json")
    events = [json.loads(line) for line in out.splitlines()]
    assert [event["number"] for event in events][:2] == [numbers[-1] - 1, numbers[-1]]
    assert said(capsys, "logs")[0] == 0


def test_a_lease_can_be_seen_and_ended(arm: Served, capsys: pytest.CaptureFixture[str]) -> None:
    assert "nobody commands left" in said(capsys, "lease")[1]
    with Robot.connect("arm:left") as robot:
        robot.acquire_lease()
        assert re.search(r"commands left, for [\d.]+ s more", said(capsys, "lease")[1])
        assert "nobody commands left now" in said(capsys, "lease", "--end")[1]
    assert "nobody commands left" in said(capsys, "lease")[1]


def test_stop_is_confirmed_and_names_what_it_could_not_stop(
    arm: Served, capsys: pytest.CaptureFixture[str]
) -> None:
    assert said(capsys, "stop", "left")[:2] == (0, "left was stopped\n")
    assert said(capsys, "stop")[:2] == (0, "left was stopped\n")
    status, _, err = said(capsys, "stop", "lefd")
    assert status == 2
    assert "no owner of arm lefd runs; there are left" in err


def test_stop_takes_the_name_as_the_other_commands_do(
    arm: Served, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "argv", ["bioscara", "stop", "--arm", "left"])
    assert program() == 0
    assert capsys.readouterr().out == "left was stopped\n"


def test_a_user_pauses_and_resumes_while_a_program_commands(
    arm: Served, capsys: pytest.CaptureFixture[str]
) -> None:
    with Robot.connect("arm:left") as robot:
        robot.acquire_lease()
        status, out, _ = said(capsys, "pause")
        assert (status, out) == (
            0,
            "left is paused; continue with: bioscara resume --arm left\n",
        )
        user = arm.robot.runner.arm.pauses.values()
        assert re.search(
            rf"^state: .*paused by {re.escape(*user)}", said(capsys, "status")[1], re.M
        )
        robot_of_another = Robot.connect("arm:left").open()
        robot_of_another.pause()
        status, out, _ = said(capsys, "resume", "--arm", "left")
        (other,) = arm.robot.runner.arm.pauses.values()
        assert (status, out) == (0, f"left stays paused by {other}\n")
        status, _, err = said(capsys, "resume")
        assert status == 2
        # Clients of one process have one name.
        assert f"paused by '{other}'; only the holder of the lease, '{other}', can resume" in err
        robot_of_another.close()
    status, out, _ = said(capsys, "resume")
    assert (status, out) == (0, "left continues\n")
    assert arm.owner.lease.client == ""
    assert said(capsys, "resume")[:2] == (0, "left is not paused\n")


def test_a_pause_without_a_name_is_of_all_arms_and_one_is_resumed(
    arm: Served, capsys: pytest.CaptureFixture[str]
) -> None:
    with serving(Robot.simulated(), ServeSettings("right", "sim", real_time_factor=50.0)) as right:
        status, out, _ = said(capsys, "pause")
        assert (status, len(out.splitlines())) == (0, 2)
        assert right.robot.runner.arm.paused
        status, _, err = said(capsys, "resume")
        assert (status, "choose one with --arm NAME" in err) == (2, True)
        said(capsys, "resume", "--arm", "right")
        assert (arm.robot.runner.arm.paused, right.robot.runner.arm.paused) == (True, False)
        said(capsys, "resume", "--arm", "left")


def test_a_simulated_fault_needs_no_lease_and_is_ended(
    arm: Served, capsys: pytest.CaptureFixture[str]
) -> None:
    with Robot.connect("arm:left") as robot:
        robot.acquire_lease()
        status, out, err = said(capsys, "simulate-fault", "freeze_encoder", "j3")
        assert (status, err) == (0, "")
        assert out.splitlines() == [
            "left simulates: j3 freeze_encoder 1",
            "end all: bioscara simulate-fault clear --arm left",
        ]
        said(capsys, "simulate-fault", "push", "j1", "-0.5", "--arm", "left")
        assert [each[:3] for each in arm.owner.robot.runner.arm.session.bus.bench.faults] == [  # type: ignore[attr-defined]
            ("freeze_encoder", "j3", 1.0),
            ("push", "j1", -0.5),
        ]
        status, out, _ = said(capsys, "simulate-fault", "clear")
        assert (status, out) == (0, "left simulates no fault that lasts\n")


@pytest.mark.parametrize(
    ("words", "refusal"),
    [
        (("hung", "j3"), "there is no simulated fault 'hung'; did you mean hang?"),
        (("hang",), "hang is a fault of one joint; there are j1, j2, j3, j4"),
        (("hang", "j5"), "there is no joint 'j5'"),
        (("push", "j3"), "push needs a value: torque or force (0 ends) [N m or N]"),
        (("push", "j3", "much"), "'much' is not a number; give bioscara simulate-fault push JOINT"),
        (
            ("bus_loss", "j3", "1"),
            "bus_loss does not take 'j3 1'; give bioscara simulate-fault bus",
        ),
        (("bus_loss", "2"), "value of bus_loss: 2 is outside 0 .. 1"),
    ],
)
def test_a_fault_that_is_not_possible_is_refused(
    words: tuple[str, ...], refusal: str, arm: Served, capsys: pytest.CaptureFixture[str]
) -> None:
    status, _, err = said(capsys, "simulate-fault", *words)
    assert status == 2
    assert refusal in err


def test_the_help_lists_the_faults_with_their_arguments(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(SystemExit):
        main(["simulate-fault", "--help"])
    lines = [line.split()[:3] for line in capsys.readouterr().out.splitlines()]
    assert [line for line in lines if line[:1] in (["hang"], ["obstacle"], ["bus_loss"])] == [
        ["hang", "JOINT", "[VALUE]"],
        ["obstacle", "JOINT", "VALUE"],
        ["bus_loss", "VALUE", "exchanges"],
    ]


def test_stop_imports_the_standard_library_only() -> None:
    # pytest's own modules are not in a new process.
    program = (
        "import sys; before = set(sys.modules); import bioscara.stop;"
        "print(*sorted({name.split('.')[0] for name in set(sys.modules) - before}))"
    )
    shown = subprocess.run(
        [sys.executable, "-c", program], check=True, capture_output=True, text=True
    )
    imported = set(shown.stdout.split())
    assert imported - set(sys.stdlib_module_names) <= {"bioscara"}


def test_a_served_arm_ends_with_a_signal_and_its_name_is_free(
    start: Callable[..., subprocess.Popen[str]],
) -> None:
    program = start("-m", "bioscara", "serve", "--name", "signalled", "--with", "", cold=True)
    lines = iter(program.stdout or ())
    assert "is served" in next(line for line in lines if "served" in line)
    assert runtime.find("signalled").pid == program.pid
    program.send_signal(signal.SIGTERM)
    rest = program.stdout.read() if program.stdout else ""
    assert program.wait(20) == 0
    assert "is not served any more; its joints are released" in rest
    assert "signalled" not in [owner.name for owner in runtime.owners()]


def test_a_name_has_one_owner(arm: Served, capsys: pytest.CaptureFixture[str]) -> None:
    status, _, err = said(capsys, "serve", "--name", "left")
    assert status == 2
    assert f"arm left has an owner, process {os.getpid()} on sim" in err


@pytest.mark.parametrize("command", [["serve"], ["demo", "--watch"]])
def test_a_folder_of_the_sockets_that_cannot_be_made_is_named(
    command: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("BIOSCARA_RUNTIME", "/proc/nope")
    status, _, err = said(capsys, *command)
    assert (status, err) == (
        2,
        "bioscara: the sockets of served arms cannot be in /proc/nope: No such file or directory; "
        "set BIOSCARA_RUNTIME to another folder\n",
    )


@pytest.fixture
def elsewhere() -> Iterator[Served]:
    """An arm on another bus than that of a command without --bus."""
    settings = ServeSettings("bench", "linux:7", real_time_factor=50.0)
    with runtime_folder(), serving(Robot.simulated(homed=True), settings) as served:
        yield served


def test_commands_about_a_lasting_arm_take_the_only_one_that_is_served(
    elsewhere: Served, capsys: pytest.CaptureFixture[str]
) -> None:
    for command in ("enable", "faults", "acknowledge", "recover", "disable"):
        status, out, err = said(capsys, command)
        assert (status, err) == (0, ""), command
        assert out.startswith("arm: arm bench: simulation"), command
    assert not elsewhere.robot.is_enabled


def test_of_several_served_arms_commands_about_a_lasting_one_name_them(
    arm: Served, capsys: pytest.CaptureFixture[str]
) -> None:
    with serving(Robot.simulated(), ServeSettings("bench", "linux:7", real_time_factor=50.0)):
        for command in ("enable", "disable", "monitor", "faults", "acknowledge", "recover"):
            with pytest.raises(SystemExit):
                main([command])
            assert "there are the arms bench, left; choose one with --arm NAME" in (
                capsys.readouterr().err
            )
        assert said(capsys, "faults", "--arm", "bench")[0] == 0


def test_a_command_that_simulates_an_arm_names_those_that_are_served(
    elsewhere: Served, capsys: pytest.CaptureFixture[str]
) -> None:
    for words in (("home",), ("move", "--name", "center"), ("gripper", "open")):
        status, out, _ = said(capsys, *words)
        assert (status, out.splitlines()[0]) == (
            0,
            "arm: simulation, in this process; --arm bench takes the served arm",
        )
    assert said(capsys, "home", "--arm", "bench")[1].startswith("arm: arm bench: ")


def test_a_served_arm_is_named_where_a_bus_is_unknown(
    elsewhere: Served, capsys: pytest.CaptureFixture[str]
) -> None:
    status, _, err = said(capsys, "home", "--bus", "bench")
    assert (status, "arm:NAME (one that 'bioscara serve' runs" in err) == (2, True)
    with pytest.raises(InvalidArgumentError, match="arm:NAME"):
        Robot.connect("bench")


def test_poses_and_tools_are_those_of_a_served_arm(
    elsewhere: Served,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    monkeypatch.chdir(tmp_path)
    of = ("--arm", "bench")
    assert said(capsys, "poses", "save", "here", *of)[1].startswith("saved here to arm bench: ")
    given = ("--pose", "0.35", "0.25", "0.2", "0.5")
    assert said(capsys, "poses", "save", "gate", *given, *of)[0] == 0
    status, _, err = said(capsys, "poses", "save", "gate", *given, *of)
    assert (status, "there is a pose gate in arm bench already" in err) == (2, True)
    needle = ("needle", "--offset", "0.05", "0", "-0.2", "0", "--mass", "0.1")
    assert said(capsys, "tools", "add", *needle, *of)[0] == 0
    assert {pose.name for pose in elsewhere.robot.table.poses} == {"here", "gate"}
    assert "needle" in said(capsys, "tools", "list", *of)[1]
    assert "pose gate, from arm bench" in said(capsys, "poses", "show", "gate", *of)[1]
    assert said(capsys, "poses", "delete", "here", *of)[1] == "deleted here from arm bench\n"
    listed = said(capsys, "poses", "list", *of)[1]
    assert ("gate" in listed, "here" in listed, "does not exist" in listed) == (True, False, False)
    assert not (tmp_path / "poses.yaml").exists()
