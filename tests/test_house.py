"""Layout and names: the overview and the map are true, and a name has one meaning."""

from __future__ import annotations

import ast
import re
import tomllib
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

from bioscara.cli.commands import COMMANDS

ROOT = Path(__file__).parents[1]
SOURCES = ROOT / "src/bioscara"
MODULES = sorted(SOURCES.rglob("*.py"))
BASES = (SOURCES, ROOT)
"""Folders in which the paths of the documents begin."""

NAMED_AFTER = ("cli/commands/", "web/routes/", "ros/controllers/", "robot/tasks/")
"""Folders whose modules have the name of a command, a route, a type of controller, or a device."""

_ENDS = ("", ".py")


def _place(path: Path) -> str:
    return path.relative_to(SOURCES).as_posix()


def _top_level_names(tree: ast.Module) -> Iterator[str]:
    for node in tree.body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            yield node.name


def _names_in(text: str) -> list[str]:
    """Return the paths in backticks."""
    spans = re.findall(r"`([\w./*-]+)`", re.sub(r"```.*?```", "", text, flags=re.DOTALL))
    suffix = re.compile(r"\.(?:py|cpp|js|ts|yaml)$")
    return [span for span in spans if "/" in span or suffix.search(span)]


def test_a_public_class_name_has_one_meaning() -> None:
    places = defaultdict(list)
    for path in MODULES:
        # A task has the name of the operation that carries it out.
        if _place(path).startswith("robot/operations/"):
            continue
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                places[node.name].append(_place(path))
    assert {name for name, found in places.items() if len(found) > 1} == set()


def test_at_most_two_modules_have_the_same_name() -> None:
    places = defaultdict(list)
    for path in MODULES:
        special = path.name in {"__init__.py", "__main__.py"}
        if not special and not _place(path).startswith(NAMED_AFTER):
            places[path.stem].append(_place(path))
    assert [found for found in places.values() if len(found) > 2] == []


def test_no_name_of_a_package_is_a_module_and_something_else() -> None:
    found = []
    for path in MODULES:
        if path.name != "__init__.py":
            continue
        tree = ast.parse(path.read_text())
        imported = {
            alias.asname or alias.name
            for node in ast.walk(tree)
            if isinstance(node, ast.ImportFrom)
            for alias in node.names
        }
        inside = {each.stem for each in path.parent.glob("*.py")}
        inside |= {each.parent.name for each in path.parent.glob("*/__init__.py")}
        found += [
            f"{_place(path)}: {name}" for name in inside & {*imported, *_top_level_names(tree)}
        ]
    assert found == []


def test_each_package_says_where_to_begin() -> None:
    packages = [path for path in MODULES if path.name == "__init__.py"]
    short = [
        _place(path)
        for path in packages
        if len((ast.get_docstring(ast.parse(path.read_text())) or "").split()) < 12
    ]
    assert short == []


def test_the_docstring_of_a_package_names_modules_that_exist() -> None:
    missing = []
    for path in MODULES:
        folder = path.parent
        text = (path.name == "__init__.py" and ast.get_docstring(ast.parse(path.read_text()))) or ""
        places = {SOURCES, ROOT / "ros", folder, folder.parent}
        for name in set(re.findall(r"``([a-z_]+)``", text)) - COMMANDS.keys():
            if not any(place.joinpath(name + end).exists() for place in places for end in _ENDS):
                missing.append(f"{_place(path)}: {name}")
    assert missing == []


def test_the_map_names_files_that_exist() -> None:
    _, _, section = (ROOT / "CONTRIBUTING.md").read_text().partition("## Where is ...?")
    rows = re.findall(r"^\| [^|]+\? \| (.+) \|$", section, re.MULTILINE)
    assert len(rows) >= 10
    missing = []
    for row in rows:
        folder = SOURCES
        for name in _names_in(row):
            bases = [base for base in (*BASES, folder) if (base / name).exists()]
            if not bases:
                missing.append(name)
            else:
                folder = (bases[0] / name).parent
    assert missing == []


def test_the_overview_names_files_that_exist() -> None:
    names = _names_in((ROOT / "docs/overview.md").read_text())
    assert [each for each in names if not any((base / each).exists() for base in BASES)] == []


def test_the_overview_has_every_package_and_the_layers_of_the_contract() -> None:
    text = (ROOT / "docs/overview.md").read_text()
    packages = {path.parent.name for path in SOURCES.glob("*/__init__.py")}
    modules = {path.name for path in SOURCES.glob("*.py")} - {"__init__.py", "__main__.py"}
    assert packages <= set(re.findall(r"\*\*`(\w+)/`\*\*", text))
    assert modules <= set(re.findall(r"`(\w+\.py)`", text))
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]
    layers = [re.findall(r"\w+", layer) for layer in contracts["contracts"][0]["layers"]]
    drawn = re.search(r"^ {4}(__main__ > (?:.+\n)+)", text, re.MULTILINE)
    assert drawn
    assert [re.findall(r"\w+", layer) for layer in drawn[1].split(">")] == layers
