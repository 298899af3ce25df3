"""The last seconds of a run, kept and written whole."""

from __future__ import annotations

import csv
import os
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from bioscara.control.faults.flight_recorder import SECONDS, Evidence
from control.control_stack import NAMES, World


def test_it_keeps_the_last_seconds_and_no_more() -> None:
    world = World(home=False)
    world.run(SECONDS + 2.0)
    assert len(world.record) == SECONDS * world.rate
    rows = world.record.freeze().rows
    assert rows[-1][0] - rows[0][0] < SECONDS
    assert world.clock.now() - rows[-1][0] < 2 * world.loop.period


def test_what_is_frozen_does_not_change() -> None:
    world = World(home=False)
    world.run(0.5)
    frozen = world.record.freeze()
    rows = frozen.rows
    world.run(0.5)
    assert frozen.rows == rows
    assert len(world.record) > len(rows)


def test_it_is_written_with_its_columns_and_read_back(tmp_path: Path) -> None:
    world = World(home=False)
    world.run(0.5)
    frozen = world.record.freeze()
    path = frozen.write(tmp_path / "new", "record", ["two\nlines", "one line"])
    lines = path.read_text().splitlines()
    assert lines[:2] == ["# two lines", "# one line"]
    table = list(csv.DictReader(lines[2:]))
    assert len(table) == len(frozen.rows)
    assert {"time", "late", "read", "update", "write"} < table[0].keys()
    for name in NAMES:
        assert float(table[-1][f"{name}_stamp"]) <= float(table[-1]["time"]) + 0.02


def test_a_name_that_is_taken_gets_a_number(tmp_path: Path) -> None:
    frozen = World(home=False).record.freeze()
    paths = [frozen.write(tmp_path, "record", []) for _ in range(3)]
    assert [path.name for path in paths] == ["record.csv", "record-2.csv", "record-3.csv"]
    assert sorted(tmp_path.iterdir()) == sorted(paths)


def test_programs_that_request_the_same_file_name_at_once_keep_their_own_evidence(
    tmp_path: Path,
) -> None:
    world = World(home=False)
    world.run(0.3)
    frozen = world.record.freeze()
    paths: list[Path] = []

    def write(program: int) -> None:
        for number in range(10):
            paths.append(frozen.write(tmp_path, "record", [f"{program} {number}"]))

    threads = [threading.Thread(target=write, args=(program,)) for program in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    texts = [path.read_text().split("\n", 1) for path in paths]
    assert {head for head, _ in texts} == {
        f"# {p} {number}" for p in range(4) for number in range(10)
    }
    assert len({rest for _, rest in texts}) == 1
    assert sorted(tmp_path.iterdir()) == sorted(paths)


class Watched(float):
    """A number that runs a callback when it is written."""

    act: Callable[[], None]

    def __format__(self, form: str) -> str:
        self.act()
        return super().__format__(form)


def test_until_a_record_is_whole_there_is_none(tmp_path: Path) -> None:
    seen: list[list[Path]] = []
    value = Watched(1.0)
    value.act = lambda: seen.append(list(tmp_path.glob("*.csv")))
    path = Evidence(("time",), ((0.0,), (value,), (2.0,))).write(tmp_path, "record", [])
    assert seen == [[]]
    assert path.read_text() == "time\n0\n1\n2\n"


def test_a_record_that_is_interrupted_leaves_nothing(tmp_path: Path) -> None:
    value = Watched(1.0)

    def interrupt() -> None:
        raise KeyboardInterrupt

    value.act = interrupt
    with pytest.raises(KeyboardInterrupt):
        Evidence(("time",), ((0.0,), (value,))).write(tmp_path, "record", [])
    assert list(tmp_path.iterdir()) == []


def test_a_record_is_on_the_disk_before_it_has_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    synced: list[tuple[int, list[Path]]] = []
    sync = os.fsync

    def fsync(file: int) -> None:
        synced.append((os.fstat(file).st_size, list(tmp_path.glob("*.csv"))))
        sync(file)

    monkeypatch.setattr(os, "fsync", fsync)
    path = Evidence(("time",), ((0.0,), (1.0,))).write(tmp_path, "record", ["remark"])
    assert synced == [(path.stat().st_size, [])]
