"""Rules for the repository as a whole."""

from __future__ import annotations

import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest

from mutants import MUTANTS
from source_places import apply

ROOT = Path(__file__).parents[1]

# A secret is recognised by its form (keys) or by an assignment of a literal to a telling name.
SECRETS = {
    "private key": r"-----BEGIN (?:[A-Z]+ )*PRIVATE KEY-----",
    "password": r"(?i)\b(?:password|passwd|psk|secret|token)\b\s*[:=]\s*[\"'][^\"'{}<$]{4,}[\"']",
    "password hash": r"\$[156y]\$[./A-Za-z0-9]{4,}\$[./A-Za-z0-9]{16,}",
    "cloud key": r"\b(?:AKIA|ASIA)[0-9A-Z]{16}\b",
}


def _tracked() -> list[Path]:
    try:
        listed = subprocess.run(
            ["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True
        ).stdout
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("not a git checkout: nothing says which files would be published")
    return [ROOT / name.decode() for name in listed.split(b"\0") if name]


def _texts() -> list[tuple[Path, str]]:
    texts = []
    for path in _tracked():
        if path.is_file() and path != Path(__file__):
            try:
                texts.append((path, path.read_text(encoding="utf-8")))
            except UnicodeDecodeError:
                continue
    return texts


def _found(text: str) -> list[str]:
    return [name for name, pattern in SECRETS.items() if re.search(pattern, text)]


@pytest.mark.parametrize(
    "text",
    [
        "-----BEGIN OPENSSH PRIVATE " + "KEY-----",
        "pass" + 'word: "scara-lab"',
        "ps" + "k='hunter22'",
        "$6$" + "rounds$" + "abcdefghijklmnopqrstuv",
    ],
)
def test_the_search_finds_what_it_looks_for(text: str) -> None:
    assert _found(text)


def test_hz15_the_repository_holds_no_secret() -> None:
    assert [(str(path), found) for path, text in _texts() if (found := _found(text))] == []


def _anchors(path: Path) -> set[str]:
    """Return the anchors of the headings of a document."""
    text = re.sub(r"```.*?```", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
    headings = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_links_in_the_documentation_lead_to_a_file_and_a_heading() -> None:
    broken = []
    for path, text in _texts():
        if path.suffix != ".md":
            continue
        for target in re.findall(r"\]\((?!https?:|mailto:)([^)\s]+)\)", text):
            name, _, anchor = target.partition("#")
            file = path.parent / name if name else path
            if not file.exists() or (
                anchor and file.suffix == ".md" and anchor not in _anchors(file)
            ):
                broken.append(f"{path.relative_to(ROOT)}: {target}")
    assert broken == []


def test_the_readme_lists_every_document_once() -> None:
    _, _, section = (ROOT / "README.md").read_text().partition("## Documentation")
    linked = re.findall(r"\]\(docs/([^)#/]+\.md)\)", section)
    assert sorted(linked) == sorted(path.name for path in (ROOT / "docs").glob("*.md"))


def test_tests_have_the_folders_of_the_sources_and_those_that_contributing_names() -> None:
    tracked = [path.relative_to(ROOT).as_posix() for path in _tracked() if path.is_file()]
    packages = set(
        re.findall(r"^src/bioscara/(.+)/__init__\.py$", "\n".join(tracked), re.MULTILINE)
    )
    folders = set(re.findall(r"^tests/(.+)/[^/]+$", "\n".join(tracked), re.MULTILINE))
    text = (ROOT / "CONTRIBUTING.md").read_text()
    sentence = re.search(r"Without counterpart are ([^.]+)\.", text)
    assert sentence
    others = set(re.findall(r"`(\w+)/`", sentence[1]))
    assert not packages & others
    assert folders == packages | others


def test_every_mutant_still_finds_its_guard() -> None:
    stale = []
    for mutant in MUTANTS:
        try:
            apply(mutant.place, mutant.old, mutant.new)
        except LookupError as error:
            stale.append(f"{mutant.guard}: {error}")
    assert stale == []


def test_the_tests_that_should_notice_a_mutant_exist() -> None:
    named = {test for mutant in MUTANTS for test in mutant.tests}
    assert sorted(test for test in named if not (ROOT / test.partition("::")[0]).exists()) == []


def test_a_mutant_whose_place_or_guard_is_gone_is_stale() -> None:
    with pytest.raises(LookupError, match=r"there is no Loop\.nothing"):
        apply("Loop.nothing", "held_up", "False")
    with pytest.raises(LookupError, match=r"'nothing' occurs 0 times in Loop\._step"):
        apply("Loop._step", "nothing", "False")
    with pytest.raises(LookupError, match=r"'self' occurs \d+ times in Loop\._step"):
        apply("Loop._step", "self", "None")


def test_a_mutant_survives_another_layout_of_its_guard() -> None:
    place, guard = "I2cTarget::interrupt", "bus.SR1 = ~(status & kErrors) & kClearable;"
    assert apply(place, "bus.SR1=~( status&kErrors )&kClearable ;", "") == apply(place, guard, "")


@pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")
@pytest.mark.parametrize("moved", [False, True])
def test_the_environment_of_a_folder_that_was_moved_is_made_anew(
    moved: bool, tmp_path: Path
) -> None:
    shutil.copy(ROOT / "Makefile", tmp_path)
    venv = tmp_path / ".venv"
    venv.mkdir()
    (venv / ".created").write_text("/elsewhere/.venv\n" if moved else f"{venv.resolve()}\n")
    done = subprocess.run(
        ["make", "-n", ".venv/.created"], cwd=tmp_path, check=True, capture_output=True, text=True
    )
    assert ("-m venv --clear .venv" in done.stdout) == moved


def test_a_package_that_calls_itself_typed_has_the_marker() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert "Typing :: Typed" in project["classifiers"]
    assert (ROOT / "src/bioscara/py.typed").is_file()


def test_clean_removes_all_that_is_ignored_except_what_an_arm_has_written(tmp_path: Path) -> None:
    shutil.copy(ROOT / "Makefile", tmp_path)
    patterns = (ROOT / ".gitignore").read_text().split()
    made, kept = [tmp_path / "src/build.py"], {"/runs/", "/faults/"}
    for pattern in patterns:
        name = pattern.strip("/").replace("*", "any")
        folders = [tmp_path] if pattern.startswith("/") else [tmp_path, tmp_path / "some/folder"]
        made += [
            folder / name / "file" if pattern.endswith("/") else folder / name for folder in folders
        ]
    for path in made:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    subprocess.run(["make", "-s", "clean"], cwd=tmp_path, check=True, capture_output=True)
    left = {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*") if path.is_file()}
    assert kept < set(patterns)
    assert left == {"Makefile", "src/build.py", "runs/file", "faults/file"}
