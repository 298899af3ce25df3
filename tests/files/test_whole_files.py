"""Files are whole or absent after any failure while they are written."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import pytest

from bioscara.files.whole_files import replacing
from full_disk import full_after


def write(path: Path, data: bytes) -> None:
    with replacing(path) as partial:
        partial.write_bytes(data)


@pytest.mark.parametrize("before", [None, b"before"])
@pytest.mark.parametrize("room", [0, 1, 999])
def test_a_full_disk_leaves_the_old_file(tmp_path: Path, before: bytes | None, room: int) -> None:
    path = tmp_path / "file"
    if before is not None:
        path.write_bytes(before)
    with full_after(room), pytest.raises(OSError, match="File too large"):
        write(path, bytes(1000))
    assert [each.name for each in tmp_path.iterdir()] == ([] if before is None else ["file"])
    assert before is None or path.read_bytes() == before


def test_an_interruption_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "file"

    def half(partial: Path) -> None:
        partial.write_bytes(b"half")
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), replacing(path) as partial:
        half(partial)
    assert list(tmp_path.iterdir()) == []


def test_permissions_and_links_are_kept(tmp_path: Path) -> None:
    path, link = tmp_path / "file", tmp_path / "link"
    path.write_bytes(b"before")
    path.chmod(0o640)
    link.symlink_to(path)
    write(link, b"after")
    assert link.is_symlink()
    assert path.read_bytes() == b"after"
    assert stat.S_IMODE(path.stat().st_mode) == 0o640


def test_a_link_to_a_file_that_is_to_be_made_stays(tmp_path: Path) -> None:
    link = tmp_path / "link"
    link.symlink_to(tmp_path / "file")
    write(link, b"after")
    assert link.is_symlink()
    assert (tmp_path / "file").read_bytes() == b"after"


def test_a_loop_of_links_is_an_error(tmp_path: Path) -> None:
    one, other = tmp_path / "one", tmp_path / "other"
    one.symlink_to(other)
    other.symlink_to(one)
    with pytest.raises(OSError, match="symbolic links"):
        write(one, b"")
    assert one.is_symlink()


def test_a_pipe_is_written_and_not_replaced(tmp_path: Path) -> None:
    # Not a device: code that replaces one would, as root, do so to the computer that tests it.
    pipe, link = tmp_path / "pipe", tmp_path / "link"
    os.mkfifo(pipe)
    link.symlink_to(pipe)
    reader = os.open(pipe, os.O_RDWR | os.O_NONBLOCK)
    try:
        for path in (pipe, link):
            write(path, b"sent")
            assert os.read(reader, 10) == b"sent"
            assert pipe.is_fifo()
    finally:
        os.close(reader)
