"""docs/migrating.md has each name of the original software, and each of its new names exists."""

from __future__ import annotations

import importlib
import re
from collections.abc import Callable, Sequence
from contextlib import redirect_stdout, suppress
from io import StringIO
from pathlib import Path
from typing import Any, NamedTuple

import pytest
import yaml

from bioscara import bus, drivers, hardware, protocol
from bioscara.cli.parser import parse
from bioscara.drivers import Gripper, Pwm
from bioscara.model import load_parameters, tags
from bioscara.protocol import REGISTERS, Flags, Register
from bioscara.sim import FirmwareBus, SimulatedArm, SimulatedServo
from simulated import World

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs/migrating.md"
TEXT = PAGE.read_text()
TICKED = re.compile(r"`([^`]+)`")
PARAMETERS = ROOT / "src/bioscara/model/parameters.yaml"


class Row(NamedTuple):
    """A row of a table: the original names, the new ones, and whether there are none."""

    original: tuple[str, ...]
    new: tuple[str, ...]
    none: bool


def rows() -> list[Row]:
    """Return the rows of the tables that lead from original names to new ones."""
    found, inside = [], False
    for line in TEXT.splitlines():
        if not line.startswith("|"):
            inside = False
            continue
        original, new, *_ = [cell.strip() for cell in line.strip("|").split("|")]
        if inside and not original.startswith("---"):
            names = TICKED.findall(original) or [original]
            found.append(Row(tuple(names), tuple(TICKED.findall(new)), new.startswith("none")))
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


KINDS: tuple[tuple[str, Callable[[str], bool]], ...] = (
    (r"make (\w+)", is_target),
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
     "bioscara nothing", "<nothing>", "joints.j1.nothing", "docs/nothing.md", "make nothing"],
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
