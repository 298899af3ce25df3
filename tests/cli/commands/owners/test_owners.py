"""The commands about running owners, and those that use the arm of one."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from bioscara import Robot
from bioscara.__main__ import main as program
from bioscara.api import runtime
from bioscara.errors import InvalidArgumentError
from bioscara.model import load_parameters
from bioscara.remote import RemoteRobot
from bioscara.server.serve import Served, ServeSettings, serving
from cli.said import Said
from entries import entry
from served import runtime_folder


@pytest.fixture(scope="module")
def arm() -> Iterator[Served]:
    """An arm named left that is served 50 times as fast as real time."""
    with serving(Robot.simulated(), ServeSettings("left", "sim", real_time_factor=50.0)) as served:
        yield served


@contextmanager
def commander() -> Iterator[None]:
    """Let another client have the lease of the arm named left."""
    with Robot.connect("arm:left") as robot:
        assert isinstance(robot, RemoteRobot)
        robot.acquire_lease()
        yield


def test_arms_are_listed(arm: Served, said: Said) -> None:
    out = said.output("arms")
    assert re.search(rf"^left +sim +{os.getpid()} +disabled, not homed +nobody$", out, re.M)


def test_the_status_of_the_only_arm_needs_no_name(arm: Served, said: Said) -> None:
    out = said.output("status")
    assert out.startswith("arm: left, simulation, in this process, version ")
    assert "commanded by: nobody" in out


def test_without_an_owner_there_is_no_status(said: Said) -> None:
    assert "no owner of arm right runs" in said.refusal("status --arm right")


def test_the_jaws_open_as_far_as_the_owner_has_them(
    said: Said, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    overlay = tmp_path / "mine.yaml"
    overlay.write_text("gripper: {upper: 0.1}\n")
    monkeypatch.setenv("BIOSCARA_PARAMETERS", "elsewhere.yaml")
    served = ServeSettings("right", "sim", real_time_factor=50.0)
    with serving(Robot.simulated(load_parameters(overlay=overlay)), served) as arm:
        out = said.output("gripper open --arm right")
        assert arm.robot.gripper.width == pytest.approx(0.1)
        assert "parameters:" not in out


def test_commands_use_the_running_owner_and_say_so(
    arm: Served, said: Said, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert said.output("home --joint j2").endswith("\nnot homed: j1, j3, j4\n")
    out = said.output("home")
    assert "arm: arm left: simulation, in this process" in out
    assert arm.robot.is_homed
    # The arm stays enabled: its owner holds it.
    assert arm.robot.is_enabled
    monkeypatch.setenv("BIOSCARA_ARM", "left")
    out = said.output("move --name center")
    assert "--joints 0.0000 0.2000 0.0000 0.0000" in out
    assert "the owner of left has; --table FILE" in said.failure("move --name gate")
    said.output("gripper 0.06")
    assert arm.robot.gripper.width == pytest.approx(0.06)
    out = said.output("gripper --servo-angle -60")
    assert "at this width the servo is at -60 deg" in out
    assert arm.robot.gripper.width == pytest.approx(0.04)
    assert "-61 deg is outside -60 .. 180 deg; there the jaws" in said.failure(
        "gripper --servo-angle -61"
    )
    for words in ((), ("open", "--servo-angle", "0")):
        wrong = said.failure("gripper", *words)
        assert wrong == "bioscara: gripper takes either a WIDTH or --servo-angle DEG\n"
    out = said.output("joints --arm left")
    assert len(re.findall(r"^j\d +0x1\d +protocol 2, firmware \S+ +\S.* yes$", out, re.M)) == 4


def test_a_command_does_not_repeat_the_warnings_that_an_owner_had(said: Said) -> None:
    with serving(
        Robot.simulated(homed=True), ServeSettings("right", "sim", real_time_factor=50.0)
    ) as served:
        served.robot.unfold()
        served.robot.runner.arm.warn("the disk is full", "home()")
        out = said.output("move --joints 1 0.3 1 0 --arm right")
        assert "warning" not in out
        state = said.output("status --arm right")
        assert re.search(r"^warning \d+ s ago: home\(\): the disk is full$", state, re.M)


def test_the_owner_chooses_rate_and_firmware(arm: Served, said: Said) -> None:
    assert "--rate is chosen by the owner of left; leave it out" in said.refusal(
        "home --arm left --rate 50"
    )
    # An option that an owner cannot take is for an arm of this process.
    assert said.output("home --v1").splitlines()[0] == (
        "arm: simulation, in this process, joints with their original firmware; --arm left takes "
        "the served arm"
    )


def test_of_two_arms_on_one_bus_one_has_to_be_named(arm: Served, said: Said) -> None:
    with serving(Robot.simulated(), ServeSettings("right", "sim", real_time_factor=50.0)):
        assert "there are the arms left, right; choose one with --arm NAME" in said.refusal("home")
        assert "choose one with --arm NAME" in said.refusal("status")
    assert [owner.name for owner in runtime.owners()] == ["left"]


def test_enable_and_disable_return_at_once(arm: Served, said: Said) -> None:
    out = said.output("enable --arm left")
    assert "enabled; left holds the joints until 'bioscara disable'" in out
    assert arm.robot.is_enabled
    assert said("disable").status == 0
    assert not arm.robot.is_enabled


def test_events_and_log_are_listed(arm: Served, said: Said) -> None:
    said("status")  # its connection and its end are events
    out = said.output("events")
    numbers = [int(line.split()[0]) for line in out.splitlines()]
    assert numbers == list(range(1, numbers[-1] + 1))
    out = said.output("events --after", str(numbers[-1] - 2), "--json")
    events = [json.loads(line) for line in out.splitlines()]
    assert [event["number"] for event in events][:2] == [numbers[-1] - 1, numbers[-1]]
    assert said("logs").status == 0


def test_a_lease_can_be_seen_and_ended(arm: Served, said: Said) -> None:
    assert "nobody commands left" in said.output("lease")
    with commander():
        assert re.search(r"commands left, for [\d.]+ s more", said.output("lease"))
        assert "nobody commands left now" in said.output("lease --end")
    assert "nobody commands left" in said.output("lease")


def test_stop_is_confirmed_and_names_what_it_could_not_stop(arm: Served, said: Said) -> None:
    assert said.output("stop left") == said.output("stop") == "left was stopped\n"
    assert "no owner of arm lefd runs; there are left" in said.refusal("stop lefd")


def test_stop_takes_the_name_as_the_other_commands_do(
    arm: Served, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "argv", ["bioscara", "stop", "--arm", "left"])
    assert program() == 0
    assert capsys.readouterr().out == "left was stopped\n"


def test_a_user_pauses_and_resumes_while_a_program_commands(arm: Served, said: Said) -> None:
    with commander():
        out = said.output("pause")
        assert out == "left is paused; continue with: bioscara resume --arm left\n"
        user = arm.robot.runner.arm.pauses.values()
        assert re.search(rf"^state: .*paused by {re.escape(*user)}", said.output("status"), re.M)
        robot_of_another = Robot.connect("arm:left").open()
        robot_of_another.pause()
        out = said.output("resume --arm left")
        (other,) = arm.robot.runner.arm.pauses.values()
        assert out == f"left stays paused by {other}\n"
        err = said.refusal("resume")
        # Clients of one process have one name.
        assert f"paused by '{other}'; only the holder of the lease, '{other}', can resume" in err
        robot_of_another.close()
    assert said.output("resume") == "left continues\n"
    assert arm.owner.lease.client == ""
    assert said.output("resume") == "left is not paused\n"


def test_a_pause_without_a_name_is_of_all_arms_and_one_is_resumed(arm: Served, said: Said) -> None:
    with serving(Robot.simulated(), ServeSettings("right", "sim", real_time_factor=50.0)) as right:
        assert len(said.output("pause").splitlines()) == 2
        assert right.robot.runner.arm.paused
        assert "choose one with --arm NAME" in said.refusal("resume")
        said("resume --arm right")
        assert (arm.robot.runner.arm.paused, right.robot.runner.arm.paused) == (True, False)
        said("resume --arm left")


def test_a_simulated_fault_needs_no_lease_and_is_ended(arm: Served, said: Said) -> None:
    with commander():
        out = said.output("simulate-fault freeze_encoder j3")
        assert out.splitlines() == [
            "left simulates: j3 freeze_encoder 1",
            "end all: bioscara simulate-fault clear --arm left",
        ]
        said("simulate-fault push j1 -0.5 --arm left")
        assert [each[:3] for each in arm.owner.robot.runner.arm.session.bus.bench.faults] == [  # type: ignore[attr-defined]
            ("freeze_encoder", "j3", 1.0),
            ("push", "j1", -0.5),
        ]
        out = said.output("simulate-fault clear")
        assert out == "left simulates no fault that lasts\n"


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
    words: tuple[str, ...], refusal: str, arm: Served, said: Said
) -> None:
    assert refusal in said.refusal("simulate-fault", *words)


def test_the_help_lists_the_faults_with_their_arguments(said: Said) -> None:
    lines = [line.split()[:3] for line in said.output("simulate-fault --help").splitlines()]
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


def test_a_name_has_one_owner(arm: Served, said: Said) -> None:
    err = said.refusal("serve --name left")
    assert f"arm left has an owner, process {os.getpid()} on sim" in err


@pytest.mark.parametrize("command", [["serve"], ["demo", "--watch"]])
def test_a_folder_of_the_sockets_that_cannot_be_made_is_named(
    command: list[str], monkeypatch: pytest.MonkeyPatch, said: Said
) -> None:
    monkeypatch.setenv("BIOSCARA_RUNTIME", "/proc/nope")
    assert said.refusal(*command) == (
        "bioscara: the sockets of served arms cannot be in /proc/nope: No such file or directory; "
        "set BIOSCARA_RUNTIME to another folder\n"
    )


@pytest.fixture
def elsewhere() -> Iterator[Served]:
    """An arm on another bus than that of a command without --bus."""
    settings = ServeSettings("bench", "linux:7", real_time_factor=50.0)
    with runtime_folder(), serving(Robot.simulated(homed=True), settings) as served:
        yield served


def test_commands_about_a_lasting_arm_take_the_only_one_that_is_served(
    elsewhere: Served, said: Said
) -> None:
    for command in ("enable", "faults", "acknowledge", "recover", "disable"):
        with entry(command):
            assert said.output(command).startswith("arm: arm bench: simulation")
    assert not elsewhere.robot.is_enabled


def test_of_several_served_arms_commands_about_a_lasting_one_name_them(
    arm: Served, said: Said
) -> None:
    with serving(Robot.simulated(), ServeSettings("bench", "linux:7", real_time_factor=50.0)):
        for command in ("enable", "disable", "monitor", "faults", "acknowledge", "recover"):
            assert "there are the arms bench, left; choose one with --arm NAME" in said.refusal(
                command
            )
        assert said("faults --arm bench").status == 0


def test_a_command_that_simulates_an_arm_names_those_that_are_served(
    elsewhere: Served, said: Said
) -> None:
    for words in (("home",), ("move", "--name", "center"), ("gripper", "open")):
        status, out, _ = said(*words)
        assert (status, out.splitlines()[0]) == (
            0,
            "arm: simulation, in this process; --arm bench takes the served arm",
        )
    assert said.output("home --arm bench").startswith("arm: arm bench: ")


def test_a_served_arm_is_named_where_a_bus_is_unknown(elsewhere: Served, said: Said) -> None:
    assert "arm:NAME (one that 'bioscara serve' runs" in said.refusal("home --bus bench")
    with pytest.raises(InvalidArgumentError, match="arm:NAME"):
        Robot.connect("bench")


def test_poses_and_tools_are_those_of_a_served_arm(
    elsewhere: Served, said: Said, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    of = ("--arm", "bench")
    assert said.output("poses save here", *of).startswith("saved here to arm bench: ")
    given = ("--pose", "0.35", "0.25", "0.2", "0.5")
    assert said("poses save gate", *given, *of).status == 0
    assert "there is a pose gate in arm bench already" in said.refusal(
        "poses save gate", *given, *of
    )
    needle = ("needle", "--offset", "0.05", "0", "-0.2", "0", "--mass", "0.1")
    assert said("tools add", *needle, *of).status == 0
    assert {pose.name for pose in elsewhere.robot.table.poses} == {"here", "gate"}
    assert "needle" in said.output("tools list", *of)
    assert "pose gate, from arm bench" in said.output("poses show gate", *of)
    assert said.output("poses delete here", *of) == "deleted here from arm bench\n"
    listed = said.output("poses list", *of)
    assert ("gate" in listed, "here" in listed, "does not exist" in listed) == (True, False, False)
    assert not (tmp_path / "poses.yaml").exists()
