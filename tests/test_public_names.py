"""The names of the top-level package: visible, where the type checker finds them, and lazy."""

from __future__ import annotations

import ast
import importlib
import inspect
import os
import pkgutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import bioscara
import bioscara.robot
from bioscara.arguments import OVERLAY_VARIABLE
from bioscara.hardware import Urdf
from bioscara.robot.sequences.sequence_file import read_sequence, write_sequence

NOT_FOR_PROGRAMS = {"api", "cli", "dashboard", "report", "ros", "server", "web"}
PACKAGES = pytest.mark.parametrize(
    "package", [bioscara, bioscara.robot], ids=lambda package: package.__name__
)


def _for_type_checkers(package: ModuleType) -> dict[str, str]:
    """Return the names that a package re-exports, and the modules from which."""
    assert package.__file__ is not None
    stub = Path(f"{package.__file__}i")
    tree = ast.parse((stub if stub.exists() else Path(package.__file__)).read_text())
    return {
        str(name.asname): str(node.module)
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom)
        for name in node.names
        if name.asname is not None
    }


@PACKAGES
def test_each_public_name_is_listed_completed_and_found_where_type_checkers_find_it(
    package: ModuleType,
) -> None:
    modules = _for_type_checkers(package)
    assert set(package.__all__) == {*modules, *({"__version__"} & {*package.__all__})}
    assert set(package.__all__) <= set(dir(package))
    for name, module in modules.items():
        assert getattr(package, name) is getattr(importlib.import_module(module), name)


@PACKAGES
def test_an_unknown_name_is_refused(package: ModuleType) -> None:
    with pytest.raises(AttributeError, match=r"has no attribute 'Robto'"):
        package.Robto  # noqa: B018


def _public_routines() -> Iterator[tuple[str, Any]]:
    """Yield the functions and methods that packages export for programs."""
    packages = [
        each.name
        for each in pkgutil.walk_packages(bioscara.__path__, "bioscara.")
        if each.ispkg and each.name.split(".")[1] not in NOT_FOR_PROGRAMS
    ]
    values = [read_sequence, write_sequence]
    for package in map(importlib.import_module, ("bioscara", *packages)):
        values += [getattr(package, name) for name in dir(package) if not name.startswith("_")]
    for value in values:
        if inspect.isroutine(value):
            yield value.__qualname__, value
        elif inspect.isclass(value) and value.__module__.startswith("bioscara."):
            for name, member in inspect.getmembers(value, inspect.isroutine):
                if name == "__init__" or not name.startswith("_"):
                    yield f"{value.__qualname__}.{name}", member


def test_each_path_may_be_a_text() -> None:
    found = {}
    for name, routine in _public_routines():
        of = inspect.unwrap(getattr(routine, "__func__", routine))
        if getattr(of, "__globals__", {}).get("Path") is not Path:
            continue
        for parameter in inspect.signature(routine).parameters.values():
            kinds = str(parameter.annotation).split(" | ")
            if "Path" in kinds:
                found[f"{name}({parameter.name})"] = "str" in kinds
    assert len(found) > 15
    assert [each for each, text in found.items() if not text] == []


def test_a_description_is_read_by_a_path_or_a_text(tmp_path: Path) -> None:
    file = tmp_path / "arm.urdf"
    file.write_text("<robot name='arm'/>")
    assert Urdf.load(str(file)).root.attrib == Urdf.load(file).root.attrib == {"name": "arm"}


def test_the_package_itself_imports_nothing() -> None:
    program = (
        "import sys; before = set(sys.modules); import bioscara; dir(bioscara); "
        "print(*sorted(set(sys.modules) - before - {'__future__', 'bioscara', 'bioscara.version'}))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == []


def test_a_program_without_a_robot_does_not_import_the_controllers() -> None:
    program = (
        "import sys; from bioscara import Pose, Scene, Trajectory, load_parameters; "
        "print(*(name for name in sys.modules if name.startswith('bioscara.control')))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == []


@pytest.mark.parametrize(
    "program",
    [
        "from bioscara import Robot, read_scene, load_table",
        "from bioscara import load_parameters; load_parameters()",
        "from bioscara.cli import main; main(['plan', '--pose', '0.4', '0.2', '0.25', '0'])",
    ],
)
def test_a_program_with_the_committed_parameters_imports_nothing_to_check_others(
    program: str,
) -> None:
    heavy = "'pydantic', 'pydantic_core', 'ruamel', 'ruamel.yaml', 'matplotlib'"
    look = f"import sys; print(*{{{heavy}}} & set(sys.modules), file=sys.stderr)"
    done = subprocess.run(
        [sys.executable, "-c", f"{program}\n{look}"],
        capture_output=True,
        text=True,
        check=True,
        env={name: value for name, value in os.environ.items() if name != OVERLAY_VARIABLE},
    )
    assert done.stderr.split() == []
