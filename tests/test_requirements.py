"""docs/requirements.md and the tests name one another."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import pytest

TESTS = Path(__file__).parent
PAGE = TESTS.parent / "docs" / "requirements.md"
RULES = re.compile(r"test_rule((?:_(?:and_)?\d\d)+)_")
OTHERS = re.compile(r"test_((?:(?:(?:hz|bus|fw|mec|host|pln|usr)\d+|jog_r\d+|stop_s\d+)_)+)")
IDENTIFIER = re.compile(r"[a-z]+\d+|jog_r\d+|stop_s\d+")
STATES = re.compile(r"held|(?:held in part|open): \S.*")


class Requirement(NamedTuple):
    """A row of the table."""

    identifier: str
    tests: list[str]
    state: str


def identifiers(test: str) -> list[str]:
    """Return the identifiers with which the name of a test begins."""
    if found := RULES.match(test):
        return [f"rule_{number}" for number in re.findall(r"\d\d", found[1])]
    found = OTHERS.match(test)
    return IDENTIFIER.findall(found[1]) if found else []


def defined_tests() -> dict[str, set[str]]:
    """Return the names of the tests in each test module, and in those of the page's functions."""
    tests: dict[str, set[str]] = {}
    for file in TESTS.rglob("test_*.py"):
        names = re.findall(r"^def (test_\w+)", file.read_text(), re.MULTILINE)
        tests.setdefault(file.stem, set()).update(names)
    for file in (TESTS / "page").glob("*.test.mjs"):
        named = re.findall(r"^ *test\([\"`](\w+): ", file.read_text(), re.MULTILINE)
        tests[f"page:{file.name.partition('.')[0]}"] = {f"test_{name}_" for name in named}
    return tests


def requirements(page: str) -> list[Requirement]:
    """Return the rows of the page."""
    rows = re.findall(r"^\| `(\w+)` \|[^|]*\|([^|]*)\| *([^|]*?) *\|$", page, re.MULTILINE)
    return [
        Requirement(name, re.findall(r"`([\w:]+)`", tests), state) for name, tests, state in rows
    ]


def complaints(rows: list[Requirement], tests: dict[str, set[str]]) -> list[str]:
    """Return all differences between the table and the tests."""
    used = {
        (identifier, module)
        for module, names in tests.items()
        for name in names
        for identifier in identifiers(name)
    }
    named = {(row.identifier, test) for row in rows for test in row.tests if "::" not in test}
    found = [f"{module} tests {name}, which does not name it" for name, module in used - named]
    found += [f"{name} names {module}, which does not test it" for name, module in named - used]
    for row in rows:
        if not STATES.fullmatch(row.state):
            found.append(f"{row.identifier}: {row.state!r} is no state")
        if row.state == "held" and not row.tests:
            found.append(f"{row.identifier} is held by no test")
        for test in row.tests:
            module, _, name = test.partition("::")
            if name and name not in tests.get(module, set()):
                found.append(f"{row.identifier} names {test}, which is no test")
    names = [row.identifier for row in rows]
    found += [f"{name} has several rows" for name in set(names) if names.count(name) > 1]
    return sorted(found)


def test_each_identifier_in_a_test_name_has_a_row_that_names_the_module_and_the_reverse() -> None:
    rows = requirements(PAGE.read_text())
    assert len(rows) > 100
    assert complaints(rows, defined_tests()) == []


@pytest.mark.parametrize(
    ("row", "complaint"),
    [
        ("| `bus1` | a | `test_a` | held |", "test_a tests bus2, which does not name it"),
        ("| `bus3` | a | `test_a` | held |", "bus3 names test_a, which does not test it"),
        (
            "| `bus3` | a | `test_a::test_c` | held |",
            "bus3 names test_a::test_c, which is no test",
        ),
        ("| `bus3` | a | - | held |", "bus3 is held by no test"),
        ("| `bus3` | a | - | open |", "bus3: 'open' is no state"),
        ("| `bus1` | a | `test_a` | held |\n" * 2, "bus1 has several rows"),
    ],
)
def test_each_kind_of_difference_is_found(row: str, complaint: str) -> None:
    tests = {"test_a": {"test_bus1_bus2_things", "test_things"}}
    assert complaint in complaints(requirements(row), tests)


def test_identifiers_are_read_from_names() -> None:
    assert identifiers("test_rule_56_and_57_hardware") == ["rule_56", "rule_57"]
    assert identifiers("test_rule_61_62_hardware") == ["rule_61", "rule_62"]
    assert identifiers("test_usr1_usr2_power") == ["usr1", "usr2"]
    assert identifiers("test_jog_r3_jog_r10_it_ends") == ["jog_r3", "jog_r10"]
    assert identifiers("test_stop_s1_it_stops") == ["stop_s1"]
    assert identifiers("test_version_1_answers") == identifiers("test_j1_homes") == []
