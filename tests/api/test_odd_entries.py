"""Odd entries in the folder of the sockets: no program hangs or fails, and each finds the arm."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from api.odd_entries import KINDS, PLACES
from bioscara.robot.tasks.scope import Scope
from programs import LIMIT, environment, wait_for_line
from served import runtime_folder
from web.gateways import Site, site

Start = Callable[..., subprocess.Popen[str]]


@pytest.fixture(scope="module")
def left() -> Iterator[Site]:
    """An arm and its gateway, and each odd entry in their folder."""
    with runtime_folder() as folder, site("left") as made:
        for number, make in enumerate(KINDS.values()):
            for name in (f"a{number}.lock", f"left.0{number}.page", f"z{number}.stop"):
                make(folder / name)
        yield made


@pytest.mark.parametrize("words", ["stop", "stop left", "arms", "status", "pause"])
def test_a_command_finds_the_arm_among_odd_entries(left: Site, start: Start, words: str) -> None:
    program = start(
        *("-m", "bioscara", *words.split()), env=environment(), stderr=subprocess.STDOUT
    )
    said, _ = program.communicate(timeout=LIMIT)
    assert program.wait() == 0, said
    assert "left" in said
    assert not re.search(r"\ba\d|Traceback", said), said


def test_completion_offers_the_arm_alone(left: Site, start: Start, tmp_path: Path) -> None:
    assert left.served
    line, found = "bioscara stop ", tmp_path / "found"
    variables = {"COMP_LINE": line, "COMP_POINT": str(len(line)), "COMP_TYPE": "9"}
    variables |= {"_ARGCOMPLETE": "1", "_ARGCOMPLETE_STDOUT_FILENAME": str(found)}
    start("-m", "bioscara", cold=True, env=environment(**variables)).wait(LIMIT)
    assert found.read_text().split() == ["left"]


def test_the_list_of_a_gateway_has_the_arm_and_its_page_alone(left: Site) -> None:
    with left.http(headers=left.bearer(Scope.VIEW)) as client:
        (found,) = client.get("/api/arms").json()
        assert (found["name"], found["page"]) == ("left", left.gateway.url)
        (stopped,) = client.post("/api/arms/stop").json()
    assert stopped["stopped"]


def test_an_owner_begins_among_odd_entries_and_is_no_other_ones(left: Site, start: Start) -> None:
    assert left.served
    words = ("-m", "bioscara", "serve", "--name")
    wait_for_line(start(*words, "right", env=environment()), "right is served")
    again = start(*words, "a0", env=environment(), stderr=subprocess.STDOUT)
    said, _ = again.communicate(timeout=LIMIT)
    assert again.wait() == 2
    assert "a0.lock: it is no regular file of this user; remove it" in said


def test_an_odd_entry_in_the_place_of_a_file_is_used_or_refused_in_words(
    start: Start,
) -> None:
    path = Path(__file__).with_name("odd_entries.py")
    with runtime_folder() as folder:
        program = start(str(path), str(folder), env=environment(), stderr=subprocess.STDOUT)
        said, _ = program.communicate(timeout=LIMIT)
    assert program.wait() == 0, said
    lines = said.splitlines()
    assert len(lines) == len(PLACES) * len(KINDS), said
    for line in lines:
        # It says which file is to be removed, or that another process has it.
        used = rf": (used$|arm left has an owner|.*{folder}/[^ ]+: left\.|{folder}/[^ ]+/left\.)"
        assert re.search(used, line), line
