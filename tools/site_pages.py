"""Pages of the documentation's site that are not in ``docs/``, a hook of mkdocs.

The README is the home page; the other documents of the repository, an index of the decisions and
the reference of the public names are added to the site, and the links between all of them follow.
"""

from __future__ import annotations

import os
import re
from pathlib import Path, PurePosixPath
from typing import Any

from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[1]
DECISIONS = "docs/decisions"
"""A folder to which documents link; the site has an index of it."""
ELSEWHERE = {
    "README.md": "index.md",
    "CHANGELOG.md": "changes.md",
    "CONTRIBUTING.md": "contributing.md",
    "SECURITY.md": "security.md",
    "LICENSE": "LICENSE.txt",
    "firmware/joint/README.md": "firmware-inside.md",
    "interfaces/README.md": "interfaces.md",
    "examples/first_move.py": "examples/first_move.py",
    "examples/move_plate.py": "examples/move_plate.py",
    "tools/iframe-worker/shim.js": "assets/iframe-worker.js",
    DECISIONS: "decisions/index.md",
}
"""Documents outside of ``docs/``, and their places in the site. Other files are not linked."""
_LINK = re.compile(r"(!?)\[([^\]]*)\]\((?!https?:|mailto:|#)([^)#\s]+)(#[^)\s]*)?\)")

REFERENCE = {
    "robot": ("Robot", "Robot and its motions"),
    "planning": ("Planning", "Planning and trajectories"),
    "workspace": ("Workspace", "Tools, poses and zones"),
    "errors": ("Errors", "Errors"),
}
"""Pages of the reference: title of each in the index, and heading."""
_PAGE_OF_PACKAGE = {
    "bioscara.robot.robot": "robot",
    "bioscara.robot.arm_methods": "robot",
    "bioscara.robot.operations": "robot",
    "bioscara.robot.robot_gripper": "robot",
    "bioscara.robot": "robot",
    "bioscara.remote": "robot",
    "bioscara.report": "robot",
    "bioscara.robot.planner": "planning",
    "bioscara.planning": "planning",
    "bioscara.planning.collision": "workspace",
    "bioscara.planning.files.scene_file": "workspace",
    "bioscara.robot.workspace": "workspace",
    "bioscara.kinematics": "planning",
    "bioscara.units": "planning",
    "bioscara.model": "workspace",
    "bioscara.errors": "errors",
}
"""Page of the names of each package, in the order in which a page has them."""
_DEFINED_IN = {"bioscara.connect": "bioscara.robot.robot"}
"""Modules that only pass a name on, and those that define it."""
_MORE = {
    "bioscara.robot.robot_gripper": ("RobotGripper",),
}
"""Types of public attributes that are no public names themselves."""


def on_files(files: Files, *, config: Any) -> Files:
    """Add the documents outside of ``docs/``, the index of decisions and the reference."""
    for source, place in ELSEWHERE.items():
        if (ROOT / source).is_file():
            text = (ROOT / source).read_text("utf-8")
            files.append(File.generated(config, place, content=text))
    files.append(File.generated(config, ELSEWHERE[DECISIONS], content=_decisions()))
    for place, text in _reference().items():
        files.append(File.generated(config, place, content=text))
    return files


def on_page_markdown(markdown: str, *, page: Any, **_: Any) -> str:
    """Lead the links of a page to their places in the site."""
    place = page.file.src_uri
    sources = {place: source for source, place in ELSEWHERE.items() if source != DECISIONS}
    source = PurePosixPath(sources.get(place, f"docs/{place}"))
    if place == ELSEWHERE["README.md"]:
        markdown = markdown.replace('<img src="docs/', '<img src="')
    return _LINK.sub(lambda link: _placed(link, source, place), markdown)


def _placed(link: re.Match[str], source: PurePosixPath, place: str) -> str:
    image, text, target, anchor = link[1], link[2], link[3], link[4] or ""
    path = os.path.normpath(source.parent / target)
    if path in ELSEWHERE:
        goal = ELSEWHERE[path]
    elif path.startswith("docs/"):
        goal = path.removeprefix("docs/")
    elif place.startswith("api/"):
        return link[0]
    else:
        return text
    return f"{image}[{text}]({os.path.relpath(goal, os.path.dirname(place) or '.')}{anchor})"


def _decisions() -> str:
    lines = ["# Decisions", ""]
    for path in sorted((ROOT / "docs/decisions").glob("[0-9]*.md")):
        title = path.read_text("utf-8").partition("\n")[0].removeprefix("# ")
        lines.append(f"- [{title}]({path.name})")
    return "\n".join(lines) + "\n"


def _reference() -> dict[str, str]:
    names: dict[str, list[str]] = {page: [] for page in REFERENCE}
    modules = {**_public_names(), **_MORE}
    order = list(_PAGE_OF_PACKAGE)
    for module in sorted(modules, key=lambda module: order.index(_package(module))):
        page = _PAGE_OF_PACKAGE[_package(module)]
        names[page] += [f"{module}.{name}" for name in modules[module]]
    pages = {}
    index = ["# Reference", "", "The names of `from bioscara import ...`:", ""]
    for page, (title, heading) in REFERENCE.items():
        entries = "\n".join(f"::: {name}\n" for name in names[page])
        pages[f"api/{page}.md"] = f"---\ntitle: {title}\n---\n\n# {heading}\n\n{entries}"
        links = ", ".join(f"[{name.rpartition('.')[2]}]({page}.md#{name})" for name in names[page])
        index += [f"**[{heading}]({page}.md)**: {links}", ""]
    return {"api/index.md": "\n".join(index), **pages}


def _package(module: str) -> str:
    """Return the package or module by which a module has its page."""
    package = module
    while package not in _PAGE_OF_PACKAGE:
        package = package.rpartition(".")[0]
        if not package:
            raise LookupError(f"{module} has no page of the reference: tools/site_pages.py")
    return package


def _public_names() -> dict[str, tuple[str, ...]]:
    """Return the public names of the package by module, without importing it."""
    found: dict[str, tuple[str, ...]] = {}
    for line in (ROOT / "src/bioscara/__init__.pyi").read_text("utf-8").splitlines():
        if line.startswith("from ") and "__version__" not in line:
            _, module, _, name, *_ = line.split()
            module = _DEFINED_IN.get(module, module)
            found[module] = (*found.get(module, ()), name)
    return found
