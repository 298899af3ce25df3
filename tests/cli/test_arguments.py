"""Parsing of the command line: options or a clear refusal, without slow imports."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from bioscara import __version__
from bioscara.cli.commands import COMMANDS
from bioscara.cli.output.angles import DEGREES, RADIANS
from bioscara.cli.parser import parse
from bioscara.kinematics import Joints, Pose
from cli.said import Said
from programs import environment


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        ("", "give a command: demo, run, "),
        ("dance", "there is no command 'dance'; there are demo, run, "),
        ("mvoe", "there is no command 'mvoe'; did you mean move?"),
        ("poses svae", "there is no poses command 'svae'; did you mean save?"),
        ("poses", "give a command: list, show, save, delete"),
        ("move --nmae center", "move has no option --nmae; did you mean --name?"),
        ("move --nmae=center", "move has no option --nmae; did you mean --name?"),
        ("run a.csv --fi", "run has no option --fi; did you mean --fit?"),
        ("run a.csv --xyzzy 3", "its options are --parameters --dry-run --from"),
        ("run", "run needs FILE: ROS 2 trajectory"),
        ("run a.csv b.csv", "there is nothing to do with 'b.csv'; leave it out; see bioscara run"),
        ("lease left right", "nothing to do with 'left right'; leave it out"),
        (
            "poses list left",
            "nothing to do with 'left'; an arm is named by --arm left; see bioscara poses list",
        ),
        ("record left", "there are start, info, recover, export, replay; an arm is named by --arm"),
        ("run a.csv --fit=3", "--fit takes no value"),
        ("move", "one of --pose X Y Z YAW, --joints J1 J2 J3 J4, --name NAME"),
        ("move center", "nothing to do with 'center'; did you mean bioscara move --name center?"),
        ("plan 'my pose'", "did you mean bioscara plan --name 'my pose'?"),
        ("move 0.3 0.1 -1e-1 0", "did you mean --pose 0.3 0.1 -1e-1 0, of the tool, or --joints"),
        ("move home", "nothing to do with 'home'; did you mean bioscara home?"),
        ("move 0.3", "nothing to do with '0.3'; leave it out; see bioscara move --help"),
        ("home j1 j2", "nothing to do with 'j1 j2'; did you mean bioscara home --joint j1 j2?"),
        ("home --joint j7", "--joint is one of j1, j2, j3, j4: home these"),
        ("gripper 60", "would be millimetres; did you mean bioscara gripper 0.06?"),
        ("help mvoe", "there is no command 'mvoe'; did you mean move?"),
        ("move --name a --pose 1 2 3 4", "--pose and --name exclude one another"),
        ("move --pose 1 2 3", "--pose has too few values; give --pose X Y Z YAW: goal pose"),
        (
            "move --name a --velocity-scaling",
            "--velocity-scaling has no value; give --velocity-scaling SHARE: share of",
        ),
        (
            "move --name a --velocity-scaling fast",
            "--velocity-scaling: 'fast' is not a number; give --",
        ),
        ("move --name a --speed 0.5", "move has no option --speed; write --velocity-scaling"),
        ("serve --speed=2", "serve has no option --speed; write --real-time-factor"),
        ("record replay a.mcap --speed 2", "write --real-time-factor"),
        ("jog --speed 2", "jog has no option --speed; did you mean --full-speed?"),
        ("demo --out", "--out has no value; give --out DIR: folder"),
        ("demo --rate 99.5", "'99.5' is not a whole number"),
        ("simulate", "simulate needs --socket PATH: Unix socket"),
        ("simulate --socket s --seed many", "--seed: 'many' is not a whole number"),
        ("flash --joint 7", "--joint is one of 1, 2, 3, 4"),
        ("demo --v1 --bus linux:1", "--v1 applies only to"),
        ("serve --homed --bus linux:1", "--homed applies only to"),
        ("ros --homed", "--homed applies only to"),
        ("enable", "enable needs an arm that outlasts this command"),
        ("monitor --bus sim", "bioscara simulate --socket"),
        ("home --arm left --bus sim", "--arm and --bus exclude one another"),
        ("home --arm left --rate 50", "--rate is chosen by the owner of left; leave it out"),
        ("home --arm left --parameters a.yaml", "--parameters is chosen by the owner of left"),
        ("serve --with webb", "there is no gateway 'webb'; did you mean web?"),
        ("serve --with 'web --prot 9000'", "web has no option --prot; did you mean --port?"),
        ("serve --with 'web --port x'", "--port: 'x' is not a port"),
        ('serve --with "web \'x"', "cannot be read: no closing quotation"),
        ("gripper wide", "WIDTH: 'wide' is not a number"),
        ("home --bus arm:left", "a served arm is named by --arm left; leave out --bus"),
        ("poses save a", "poses save needs one of --arm NAME or --bus BUS"),
        ("poses save a --joints 1 2 3", "--joints has too few values"),
        ("poses save a --joints 0 0 0 0 --bus sim", "--bus and --joints exclude one another"),
        ("poses save", "poses save needs NAME"),
        ("poses save a --bus sim --arm left", "--arm and --bus exclude one another"),
        ("poses list --table a.yaml --arm left", "--arm and --table exclude one another"),
        ("poses show a --from 0 0.2 0 0", "add --plot"),
        ("poses show a --scene start.yaml", "add --plot"),
        ("poses show a --world start.yaml", "add --plot"),
        ("serve --scene a.yaml --world b.yaml", "--scene and --world exclude one another"),
        ("record sart", "there is no record command 'sart'; did you mean start?"),
        ("record --size 3", "record start has no option --size"),
        ("record --max-size much", "'much' is not a number"),
        ("record --max-size 0", "'0' is not a size from 1 byte on"),
        ("record --max-time 0", "'0' is not above zero"),
        ("record --keep 1M", "--keep is smaller than --max-size"),
        ("record info", "record info needs FILE"),
        ("record export a.mcap", "record export needs one of --csv DIR, --parquet DIR"),
        ("web --tls-cert a", "--tls-cert needs --tls-key"),
        ("web --tls-key a", "--tls-key needs --tls-cert"),
        ("web --tls-cert a --tls-key b --tls-self-signed", "exclude one another"),
        ("web --port 70000", "is not a port"),
        ("view --port -1", "is not a port"),
        ("view good --name plate", "exclude one another"),
        ("view --linear", "--linear applies to a planned motion; add --pose"),
        ("view good --from 0 0.2 0 0", "--from applies to a planned motion"),
        ("view a.csv --velocity-scaling 0.5", "--velocity-scaling applies to a planned motion"),
        ("web --ros-args", "web has no option --ros-args"),
        ("ros --arm left --bus sim", "--arm and --bus exclude one another"),
        ("flash --joint 1 --bus sim", "--bus sim has no board to flash"),
        ("flash --all", "--all finds the joints by their bus: name it, as --bus linux:1"),
        ("flash --all --bus linux:1 --joint 1", "--joint and --all exclude one another"),
        ("flash --all --bus linux:1 --swd", "--all and --swd exclude one another"),
        ("flash --all --bus linux:1 j1.bin", "--all and FILE exclude one another"),
        ("flash --all --bus linux:1 --serial 1", "--all and --serial exclude one another"),
        ("flash --all --bus sim", "--bus sim has no board to flash"),
    ],
)
def test_wrong_usage_is_one_sentence_that_names_the_word_and_the_remedy(
    words: str, complaint: str, said: Said
) -> None:
    assert complaint in said.refusal(words)


@pytest.mark.parametrize(
    "command",
    [
        *("run a.csv", "move --name a", "home", "jog", "gripper open", "enable", "disable"),
        *("monitor", "joints", "faults", "acknowledge", "recover", "record start", "web", "ros"),
        *("status", "lease", "events --follow", "logs"),
    ],
)
def test_a_stray_word_may_be_an_arm_for_every_command_that_takes_one(
    command: str, said: Said
) -> None:
    err = said.refusal(f"{command} left")
    assert "with 'left'; an arm is named by --arm left; see bioscara" in err


def test_the_shell_gets_the_remedy_for_an_arm_as_a_word() -> None:
    command = [sys.executable, "-m", "bioscara", "status", "left"]
    said = subprocess.run(command, capture_output=True, text=True, env=environment(), check=False)
    assert (said.returncode, said.stdout) == (2, "")
    assert "an arm is named by --arm left; see bioscara status --help" in said.stderr


def test_the_variable_names_an_arm_only_where_no_bus_is_given(
    monkeypatch: pytest.MonkeyPatch, said: Said
) -> None:
    monkeypatch.setenv("BIOSCARA_ARM", "left")
    assert parse(["home"]).arm == "left"
    for bus in ("sim", "linux:1"):
        options = parse(["home", "--bus", bus])
        assert (options.arm, options.bus) == (None, bus)
    refused = "--rate is chosen by the owner of left (from BIOSCARA_ARM); leave it out"
    assert refused in said.refusal("home --rate 50")


def test_gateways_are_given_by_names_or_one_by_one_with_options() -> None:
    words = ["serve", "--with", "record,web", "--with", "web --port 9000"]
    assert parse(words).gateways == [("record",), ("web",), ("web", "--port", "9000")]


@pytest.mark.parametrize("value", ["-1e-3", "-.5", "-2", "-0.25", "-1E2"])
def test_numbers_may_be_negative_in_any_form(value: str) -> None:
    options = parse(["move", "--joints", value, value, "0", value])
    assert options.joints == [float(value), float(value), 0.0, float(value)]


@pytest.mark.parametrize("degrees", [False, True])
@given(values=st.lists(st.floats(-6.0, 6.0), min_size=4, max_size=4))
def test_words_that_are_shown_are_the_target_they_show(values: list[float], degrees: bool) -> None:
    unit = DEGREES if degrees else RADIANS
    for shown in (Joints(*values), Pose(*values)):
        options = parse(["move", *unit.words(shown).split()])
        assert options.degrees == degrees
        given_back = options.joints if isinstance(shown, Joints) else options.pose
        assert given_back == pytest.approx(list(values), abs=1e-4)


def test_every_command_that_moves_an_arm_takes_rate_and_priority() -> None:
    for words in ("demo", "run a.csv", "move --name a", "home", "jog", "gripper open"):
        options = parse([*words.split(), "--rate", "50", "--priority", "80"])
        assert (options.rate, options.priority) == (50, 80)


def test_the_simulated_arm_is_the_default() -> None:
    options = parse(["run", "a.csv"])
    assert options.bus == "sim"
    assert options.file == Path("a.csv")
    assert options.out is None
    assert (options.fit, options.realtime, options.v1) == (False, False, False)


def test_the_version_is_printed(said: Said) -> None:
    assert __version__ in said.output("--version")


def test_help_is_also_a_word(said: Said) -> None:
    for word, option in (("help", "--help"), ("help poses save", "poses save --help")):
        assert said.output(word) == said.output(option)


def test_no_help_imports_anything_heavy() -> None:
    # The help of simulate-fault lists the faults of the compiled firmware.
    code = (
        "import sys\n"
        "from bioscara.cli.commands import COMMANDS\n"
        "from bioscara.cli.parser import parse\n"
        "for name in COMMANDS.keys() - {'simulate-fault'}:\n"
        "    try: parse([name, '--help'])\n"
        "    except SystemExit: pass\n"
        "heavy = {'numpy', 'rich', 'ruamel', 'matplotlib', 'yaml', 'asyncio', 'pydantic'}\n"
        "print(*(heavy & set(sys.modules)), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.count("usage: bioscara ") == len(COMMANDS) - 1
    assert done.stderr.split() == []


def test_numpy_computes_in_one_thread() -> None:
    code = (
        "import os, sys\n"
        "from bioscara.__main__ import main\n"
        "sys.argv = ['bioscara', '--version']\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "import numpy\n"
        "print(len(os.listdir('/proc/self/task')), file=sys.stderr)"
    )
    environment = {
        name: value for name, value in os.environ.items() if name != "OPENBLAS_NUM_THREADS"
    }
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment
    )
    assert done.stderr.split() == ["1"]
