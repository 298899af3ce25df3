"""docs/migrating.md has each name of the original software, and each of its new names exists."""

from __future__ import annotations

import importlib
import math
import re
from collections.abc import Callable, Sequence
from contextlib import nullcontext, redirect_stdout, suppress
from io import StringIO
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple

import pytest
import yaml

from bioscara import bus, drivers, hardware, protocol
from bioscara.cli.parser import parse
from bioscara.drivers import Gripper, Pwm
from bioscara.errors import BioscaraError
from bioscara.model import load_parameters, tags
from bioscara.protocol import REGISTERS, Flags, Register
from bioscara.sim import FirmwareBus, SimulatedArm, SimulatedServo
from entries import entry
from simulated import World

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs/migrating.md"
TEXT = PAGE.read_text()
TICKED = re.compile(r"`([^`]+)`")
PARAMETERS = ROOT / "src/bioscara/model/parameters.yaml"


class Row(NamedTuple):
    """A row of a table: the original names, the new ones, and what differs."""

    original: tuple[str, ...]
    new: tuple[str, ...]
    none: bool
    differs: str


def rows() -> list[Row]:
    """Return the rows of the tables that lead from original names to new ones."""
    found, inside = [], False
    for line in TEXT.splitlines():
        if not line.startswith("|"):
            inside = False
            continue
        original, new, *differs = [cell.strip() for cell in line.strip("|").split("|")]
        if inside and not original.startswith("---"):
            names = TICKED.findall(original) or [original]
            found.append(
                Row(tuple(names), tuple(TICKED.findall(new)), new.startswith("none"), *differs)
            )
        inside = inside or (original, new) == ("original", "here")
    return found


ROWS = rows()
ADDED = TICKED.findall(TEXT.partition("## Without counterpart in the original")[2])


@pytest.fixture(scope="module")
def objects() -> dict[str, Any]:
    """Return the objects whose attributes the tables name: a joint, a gripper, its PWM, an arm."""
    arm, jaws = SimulatedArm(), load_parameters().gripper
    pwm = Pwm(jaws.outputs, arm.clock, SimulatedServo(jaws.outputs[0]).root)
    return {
        "Joint": World().joints[0],
        "Gripper": Gripper(pwm, jaws, Path("unused")),
        "Pwm": pwm,
        "ArmHardware": hardware.ArmHardware(
            "bioscara_arm", FirmwareBus(arm), arm.clock, load_parameters().joints
        ),
    }


def commands() -> set[str]:
    """Return the commands that the program lists."""
    with redirect_stdout(StringIO()) as shown, suppress(SystemExit):
        parse(["--help"])
    return set(re.findall(r"^    ([a-z]+)(?: |$)", shown.getvalue(), re.M))


COMMANDS = commands()
TAGS = {*tags.JOINT_TAGS.values(), *tags.HOMING_TAGS.values(), *tags.GRIPPER_TAGS.values()}


def has(start: Any, names: Sequence[str]) -> bool:
    """Return whether ``start.names[0].names[1]...`` exists."""
    for name in names:
        if not hasattr(start, name):
            return False
        start = getattr(start, name)
    return True


def is_parameter(name: str) -> bool:
    """Return whether parameters.yaml has this key; dots separate its levels."""
    value = yaml.safe_load(PARAMETERS.read_text())
    for key in name.split("."):
        if not isinstance(value, dict) or key not in value:
            return False
        value = value[key]
    return True


def is_absolute(name: str) -> bool:
    """Return whether this is a module, or an object in one."""
    parts = name.split(".")
    for depth in range(len(parts), 0, -1):
        try:
            module = importlib.import_module(".".join(parts[:depth]))
        except ModuleNotFoundError:
            continue
        return has(module, parts[depth:])
    return False


def is_short(name: str, objects: dict[str, Any]) -> bool:
    """Return whether one of the packages that the page names has this object."""
    first, *rest = name.split(".")
    if first in objects:
        return has(objects[first], rest)
    return any(has(each, (first, *rest)) for each in (drivers, bus, hardware, protocol))


def is_target(name: str) -> bool:
    """Return whether the Makefile has this target."""
    return re.search(rf"^{name}:", (ROOT / "Makefile").read_text(), re.M) is not None


def is_launch_file(name: str) -> bool:
    """Return whether a package installs this launch file, as in ``PACKAGE FILE``."""
    package, file = name.split()
    return (ROOT / "ros" / package / "launch" / file).exists()


KINDS: tuple[tuple[str, Callable[[str], bool]], ...] = (
    (r"make (\w+)", is_target),
    (r"ros2 launch (\w+ \S+)", is_launch_file),
    (r"bioscara (\w+).*", COMMANDS.__contains__),
    (r"<(\w+)>", TAGS.__contains__),
    (r"(LICENSE|.*/.*)", lambda path: (ROOT / path).exists()),
    (r"((?:joints|gripper)\..*)", is_parameter),
    (r"(bioscara\..*?)(?:\(\))?", is_absolute),
)
"""Forms of new names, and whether such a name exists; the first form that fits counts."""


def exists(name: str, objects: dict[str, Any]) -> bool:
    """Return whether a new name exists, in any form in which the page gives it."""
    for form, check in KINDS:
        if match := re.fullmatch(form, name):
            return check(match[1])
    return is_short(name.removesuffix("()"), objects)


@pytest.mark.parametrize(
    "name",
    ["Joint.nothing()", "Register.NOTHING", "bioscara.nothing", "bioscara.drivers.Nothing",
     "bioscara nothing", "<nothing>", "joints.j1.nothing", "docs/nothing.md", "make nothing",
     "ros2 launch scene_bringup nothing.launch.py"],
)  # fmt: skip
def test_a_name_that_does_not_exist_is_noticed(name: str, objects: dict[str, Any]) -> None:
    assert not exists(name, objects)


def test_each_new_name_exists(objects: dict[str, Any]) -> None:
    assert len(ROWS) > 100
    named = [name for row in ROWS for name in row.new] + [n for n in ADDED if "." in n]
    assert [name for name in named if not exists(name, objects)] == []


def test_each_row_leads_to_a_name_or_says_that_there_is_none() -> None:
    assert [row.original for row in ROWS if not (row.new or row.none)] == []


def test_each_original_name_has_a_row() -> None:
    lines = (ROOT / "tests/data/original_names.txt").read_text().splitlines()
    names = {name for line in lines if not line.startswith("#") for name in line.split()}
    listed = {name for row in ROWS for name in row.original}
    assert sorted(names - listed) == []


def test_names_that_are_the_same_are_in_the_files_of_their_row() -> None:
    same = [row for row in ROWS if row.differs.startswith("the same") and "ros/" in row.new[0]]
    assert len(same) > 10
    missing = []
    for row in same:
        paths = [path for name in row.new for path in ((ROOT / name), *(ROOT / name).rglob("*"))]
        texts = [path.read_text() for path in paths if path.is_file() and path.suffix != ".stl"]
        names = {path.name.removesuffix(".yaml").removesuffix(".launch.py") for path in paths}
        names |= {path.name for path in paths}
        for name in row.original:
            word = re.compile(rf"(?<![\w.]){re.escape(name)}(?!\w)")
            if name not in names and not any(word.search(text) for text in texts):
                missing.append(name)
    assert missing == []


def calls(joint: Any) -> list[tuple[str, str, tuple[Any, ...], str]]:
    """Return calls with the original's arguments, in an order in which a program makes them.

    Each is an original name, the new one, the arguments, and the refusal; empty for none.
    """
    seek, offset = joint.parameters.homing, joint.parameters.home_position
    approach = (seek.velocity, seek.threshold, seek.current_percent)
    j4, off = joint.parameters, Register.DISABLECLOSEDLOOP
    return [
        ("init", "Joint.init()", (), ""),
        ("getPosition", "Joint.get_position()", (), "j4: no position before home()"),
        ("enable", "Joint.enable()", (20, 20), ""),
        ("home", "Joint.home()", (seek.velocity, 30, 15), ""),
        ("setPosition", "Joint.set_position()", (offset - 0.01,), ""),
        ("setVelocity", "Joint.set_velocity()", (-0.1,), ""),
        ("stop", "Joint.stop()", (), ""),
        ("stop_homing", "Joint.stop()", (), ""),
        ("moveSteps", "Joint.move_steps()", (-100,), ""),
        ("getPosition", "Joint.get_position()", (), ""),
        ("getVelocity", "Joint.get_velocity()", (), ""),
        ("checkOrientation", "Joint.check_orientation()", (10,), "in rad: 10 degrees are 0.17453"),
        ("setDriveCurrent", "Joint.settings.set_drive_current()", (20,), ""),
        ("setHoldCurrent", "Joint.settings.set_hold_current()", (20,), ""),
        ("setBrakeMode", "Joint.settings.set_brake_mode()", (1,), ""),
        ("setMaxAcceleration", "Joint.set_max_acceleration()", (j4.max_acceleration,), ""),
        ("enableStallguard", "Joint.settings.enable_stallguard()", (6,), ""),
        ("enableStallguard", "Joint.settings.enable_stallguard()", (0,), "outside 1 .. 255"),
        ("clearStall", "Joint.clear_stall()", (), ""),
        ("isHomed", "Joint.is_homed()", (), ""),
        ("isEnabled", "Joint.is_enabled()", (), ""),
        ("isStalled", "Joint.is_stalled()", (), ""),
        ("isBusy", "Joint.is_busy()", (), ""),
        ("getFlags", "Joint.get_flags()", (), ""),
        ("checkCom", "Joint.check_communication()", (), ""),
        ("getHomingOffset", "Joint.feedback.read_offset()", (), ""),
        ("setHomingOffset", "Joint.feedback.store_offset()", (offset,), ""),
        ("printInfo", "Joint.read_state()", (), ""),
        ("read", "Joint.session.read()", (Register.ANGLEMOVED,), ""),
        ("write", "Joint.session.write()", (Register.SETCURRENT, 20), ""),
        ("_home", "Joint.start_homing()", (0.0, 30, 15), "0 has no direction"),
        ("startHoming", "Joint.start_homing()", approach, ""),
        ("postHoming", "Joint.post_homing()", (), "homing is still running"),
        ("stop_homing", "Joint.stop()", (), ""),
        ("enable", "Joint.enable()", (), ""),
        ("setMaxVelocity", "Joint.set_max_velocity()", (j4.max_velocity,), ""),
        ("disableCL", "Joint.settings.disable_closed_loop()", (), ""),
        ("write", "Joint.session.write()", (off, 0), ""),
        ("disable", "Joint.disable()", (), ""),
        ("deinit", "Joint.deinit()", (), ""),
    ]


@pytest.mark.parametrize("kind", [{}, {"v1_frames": True}, {"v1": True}], ids=str)
def test_each_function_of_a_joint_takes_the_arguments_of_the_original(kind: Any) -> None:
    """Or it is refused with a remedy, where the page says so."""
    world = World(**kind)
    joint = world.joints[3]
    tried = calls(joint)
    for original, new, arguments, refusal in tried:
        with entry(f"{original}{arguments}"):
            assert any(original in row.original and new in row.new for row in ROWS)
            function = attrgetter(new.removeprefix("Joint.").removesuffix("()"))(joint)
            with pytest.raises(BioscaraError) if refusal else nullcontext() as refused:
                function(*arguments)
            assert refusal in str(refused.value if refused else "")
        world.arm.run(0.02)
    named = {name for row in ROWS for name in row.new if re.fullmatch(r"Joint\..*\(\)", name)}
    assert named == {new for _, new, *_ in tried if new.endswith("()")}


def test_the_transmission_is_that_of_the_original() -> None:
    for joint in load_parameters().joints:
        offset = joint.home_position
        transmission = drivers.Transmission(joint.reduction, offset)
        for position in (joint.lower, 0.1, joint.upper):
            degrees = transmission.position_to_deg(position)
            assert math.radians(degrees) == pytest.approx((position - offset) * joint.reduction)
            assert transmission.position_from_deg(degrees) == pytest.approx(position)


def test_the_gripper_refuses_the_units_of_the_original(tmp_path: Path) -> None:
    arm, jaws = SimulatedArm(), load_parameters().gripper
    with SimulatedServo(jaws.outputs[0]) as servo:
        pwm: Any = Pwm(jaws.outputs, arm.clock, servo.root)
        gripper = Gripper(pwm, jaws, tmp_path / "last_pos")
        gripper.enable()
        gripper.set_servo_angle(10)
        pulse = pwm.pulse()
        for function, arguments, refusal in (
            (gripper.set_width, (60,), "60 mm are 0.06"),
            (pwm.start, (0, 50, 7.5, 2), "takes 3 positional arguments"),
            (pwm.start, (50, 7.5), "PWM period: 50 s is outside 0 .. 4 s"),
            (pwm.set_pulse, (7.5,), "PWM pulse: 7.5 s is outside 0 .. 4 s"),
        ):
            with entry(function), pytest.raises((BioscaraError, TypeError), match=refusal):
                function(*arguments)
            assert pwm.pulse() == pulse


def test_each_name_of_the_drivers_is_on_the_page(objects: dict[str, Any]) -> None:
    """Each public name either replaces a name of the original or is listed as new."""
    named = {name.removesuffix("()") for row in ROWS for name in row.new}
    named |= {name.removesuffix("()") for name in ADDED}
    joint = objects["Joint"]
    public = {
        f"{prefix}.{name}"
        for prefix, start in (
            ("Joint", joint),
            ("Joint.settings", joint.settings),
            ("Gripper", objects["Gripper"]),
            ("Pwm", objects["Pwm"]),
        )
        for name in dir(start)
        if not name.startswith("_")
    }
    public |= {f"Register.{each.name}" for each in Register}
    public |= {f"Flags.{each.name}" for each in Flags}
    public |= {f"<{tag}>" for tag in TAGS}
    parts = {name.rpartition(".")[0] for name in named if name.startswith("Joint.")}
    assert sorted(public - named - parts - {"Gripper.parameters", *same_as_settings(joint)}) == []


def same_as_settings(joint: Any) -> set[str]:
    """Return the settings that a joint offers itself, too."""
    return {f"Joint.settings.{name}" for name in dir(joint.settings) if hasattr(joint, name)}


def test_each_register_of_version_1_has_its_original_name() -> None:
    listed = {name for row in ROWS for name in row.original}
    first = {row.register.name for row in REGISTERS if row.version == 1}
    assert first - {"RUNCONTINUOUS"} <= listed
