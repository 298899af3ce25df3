"""Names, locks and sockets of running owners."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from bioscara import Robot
from bioscara.api import runtime
from bioscara.api.runtime import OwnerClaim, find, lock_file, owners, require_name, socket_of
from bioscara.errors import AccessError, BusyOwnerError, InvalidArgumentError, OwnerLostError
from bioscara.stop import main as stop
from bioscara.web.owner.stream import OwnerStream
from programs import environment, wait_for_line
from served import NAME, runtime_folder

HOLDER = """
import os, sys, time
from bioscara.api.runtime import OwnerClaim
claim = OwnerClaim(sys.argv[1], "sim")
print("claimed", flush=True)
time.sleep(60)
"""


@pytest.fixture
def folder() -> Iterator[Path]:
    with runtime_folder() as made:
        yield made


@pytest.mark.parametrize("name", ["a", "arm", "Left-2_b", "x" * 64])
def test_names_of_arms(name: str) -> None:
    assert require_name(name) == name


@pytest.mark.parametrize(
    "name", ["", "1a", "-a", "a b", "a/b", "..", "a\n", "ä", "x" * 65, "a.sock", None, 3]
)
def test_an_invalid_name_of_an_arm_is_refused(name: str) -> None:
    with pytest.raises(InvalidArgumentError, match="no name of an arm"):
        require_name(name)


def test_a_path_that_is_too_long_for_a_socket_is_refused(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv(runtime.VARIABLE, str(tmp_path / ("x" * 100)))
    with pytest.raises(InvalidArgumentError, match="at most 107 bytes"):
        socket_of("left")


def test_the_folder_is_chosen_by_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(runtime.VARIABLE, "/a")
    assert runtime.folder() == Path("/a")
    monkeypatch.delenv(runtime.VARIABLE)
    monkeypatch.setenv("XDG_RUNTIME_DIR", "/run/user/5")
    assert runtime.folder() == Path("/run/user/5/bioscara")
    monkeypatch.delenv("XDG_RUNTIME_DIR")
    monkeypatch.setattr(os, "getuid", lambda: 0)
    assert runtime.folder() == Path("/run/bioscara")
    monkeypatch.setattr(os, "getuid", lambda: 987_654)
    assert runtime.folder() == Path("/tmp/bioscara-987654")


def test_a_folder_that_another_user_made_is_not_used(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "getuid", lambda: 987_654)
    with pytest.raises(AccessError, match="belongs to user"):
        OwnerClaim("left", "sim")
    made = folder / "made"
    made.mkdir()
    monkeypatch.setattr(runtime, "Path", lambda _: made)
    monkeypatch.delenv(runtime.VARIABLE)
    monkeypatch.delenv("XDG_RUNTIME_DIR", raising=False)
    with pytest.raises(AccessError, match="belongs to another user"):
        runtime.folder()


def test_a_folder_that_all_users_can_write_is_not_used(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder.chmod(0o777)
    with pytest.raises(AccessError, match="written by every user"):
        OwnerClaim("left", "sim")
    folder.chmod(0o1777)
    OwnerClaim("left", "sim").close()
    folder.chmod(0o700)
    inner = folder / "inner" / "made"
    inner.mkdir(parents=True)
    monkeypatch.setenv(runtime.VARIABLE, str(inner))
    inner.parent.chmod(0o777)
    with pytest.raises(AccessError, match=f"{inner.parent}, which .* written by every user"):
        OwnerClaim("left", "sim")


def test_a_folder_that_a_group_can_write_is_used_for_that_group_only(folder: Path) -> None:
    folder.chmod(0o770)
    with pytest.raises(AccessError, match=r"written by the group with number .* chmod g-w"):
        OwnerClaim("left", "sim")
    claim = OwnerClaim("left", "sim", shared=True)
    claim.share(os.getgid())
    # It has the folder as it needs it: its members find the owner, and put nothing there.
    assert folder.stat().st_mode & 0o777 == 0o750
    claim.close()


def test_a_link_to_a_folder_is_not_used(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "made").mkdir(mode=0o700)
    (folder / "link").symlink_to(folder / "made")
    monkeypatch.setenv(runtime.VARIABLE, str(folder / "link"))
    with pytest.raises(AccessError, match="is a link"):
        OwnerClaim("left", "sim")


def test_an_owner_is_found_while_it_holds_its_claim(folder: Path) -> None:
    claim = OwnerClaim("left", "linux:1")
    assert find("left") == (("left", "linux:1", os.getpid(), folder / "left.sock"))
    assert owners() == [find("left")]
    with pytest.raises(OwnerLostError, match="there are left"):
        find("right")
    with pytest.raises(BusyOwnerError, match=f"process {os.getpid()} on linux:1"):
        OwnerClaim("left", "sim")
    claim.close()
    claim.close()
    assert owners() == []
    with pytest.raises(OwnerLostError, match="bioscara serve starts one"):
        find("left")
    OwnerClaim("left", "sim").close()


def test_arms_of_services_are_found_too_and_their_names_are_taken(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    service = OwnerClaim("left", "linux:1")
    with runtime_folder() as own:
        monkeypatch.setattr(runtime, "SERVICES", folder)
        monkeypatch.delenv(runtime.VARIABLE)
        monkeypatch.setenv("XDG_RUNTIME_DIR", str(own))
        assert find("left").socket == service.socket
        with pytest.raises(BusyOwnerError, match=r"process \d+ on linux:1, a service"):
            OwnerClaim("left", "sim")
        mine = OwnerClaim("right", "sim")
        assert [each.socket for each in owners()] == [service.socket, mine.socket]
        monkeypatch.setattr(os, "access", lambda *_: False)
        with pytest.raises(OwnerLostError, match="members of the group bioscara, after their"):
            find("other")
        monkeypatch.setenv(runtime.VARIABLE, str(own / "bioscara"))
        assert [each.name for each in owners()] == ["right"]
        mine.close()
    service.close()


def test_a_killed_owner_holds_nothing(folder: Path) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", HOLDER, "left"],
        env=environment(),
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        wait_for_line(process, "claimed")
        assert find("left").pid == process.pid
        with pytest.raises(BusyOwnerError, match=f"process {process.pid}"):
            OwnerClaim("left", "sim")
        process.kill()
    assert (folder / "left.lock").exists()
    assert owners() == []
    OwnerClaim("left", "sim").close()


@pytest.mark.parametrize(
    "text",
    ["", "{", "[]", "{}", '{"pid": "x", "bus": 1}', '{"pid": 1e400, "bus": "b"}', "[" * 4000],
)
def test_a_lock_with_any_content_is_no_owner_that_can_be_used(folder: Path, text: str) -> None:
    claim = OwnerClaim("left", "sim")
    (folder / "left.lock").write_text(text)
    with pytest.raises(OwnerLostError):
        find("left")
    with pytest.raises(BusyOwnerError, match="another process"):
        OwnerClaim("left", "sim")
    claim.close()


def test_files_of_other_names_are_no_owners(folder: Path) -> None:
    for name in ("1.lock", "a b.lock", "x.txt", ".lock"):
        (folder / name).write_text(json.dumps({"pid": 1, "bus": "sim"}))
    assert owners() == []


def test_removed_files_are_made_again_unless_another_owner_has_begun(folder: Path) -> None:
    claim = OwnerClaim("left", "sim")
    (folder / "left.lock").unlink()
    # As its server does.
    claim.listener.close()
    assert claim.restore()
    assert find("left").pid == os.getpid()
    (folder / "left.lock").unlink()
    other = OwnerClaim("left", "linux:1")
    with pytest.raises(BusyOwnerError):
        claim.restore()
    claim.close()
    assert other.socket.is_socket()
    assert find("left").bus == "linux:1"
    other.close()


@pytest.mark.skipif(os.getuid() != 0, reason="only root can be another user")
def test_a_socket_that_another_user_has_put_in_the_place_of_the_owners_gets_nothing(
    capfd: pytest.CaptureFixture[str],
) -> None:
    with runtime_folder() as folder:
        # As a group that may write there.
        folder.chmod(0o1777)
        told, telling = os.pipe()
        lock = lock_file(folder / f"{NAME}.lock", {"pid": os.getpid(), "bus": "sim"})
        assert lock is not None
        child = os.fork()
        if child == 0:
            os.setgid(12345)
            os.setuid(12345)
            listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
            listener.bind(os.fspath(folder / f"{NAME}.sock"))
            os.chmod(folder / f"{NAME}.sock", 0o666)
            listener.listen(8)
            os.write(telling, b"1")
            while True:
                connection, _ = listener.accept()
                os.write(telling, b"got:" + connection.recv(1 << 16))
                connection.close()
        try:
            assert os.read(told, 1) == b"1"
            refused = f"of user 12345 listens at {folder}"
            with pytest.raises(AccessError, match=refused):
                Robot.connect(f"arm:{NAME}").open()
            assert stop([NAME]) == 1
            assert refused in capfd.readouterr().err
            with pytest.raises(OwnerLostError, match=refused):
                asyncio.run(OwnerStream.open(NAME))
            # Each of the three has connected, and sent nothing.
            received = b""
            while len(received) < len(b"got:" * 3):
                received += os.read(told, 64)
            assert received == b"got:" * 3
        finally:
            os.close(lock)
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
