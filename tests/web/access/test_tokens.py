"""The file with the tokens."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from bioscara.errors import AccessError, ConfigurationError
from bioscara.robot.tasks.scope import Scope
from bioscara.web.access.tokens import Tokens, load_tokens


def test_a_file_is_made_with_three_tokens_of_128_bits_for_its_user_alone(tmp_path: Path) -> None:
    path = tmp_path / "arm.tokens"
    before = os.umask(0)
    try:
        tokens = load_tokens(path)
    finally:
        os.umask(before)
    assert path.stat().st_mode & 0o7777 == 0o600
    given = json.loads(path.read_text())
    assert list(given) == ["view", "operate", "admin"]
    assert len(set(given.values())) == 3
    for scope in Scope:
        assert len(bytes.fromhex(tokens.of(scope))) == 16
        assert tokens.scope_of(tokens.of(scope)) == scope
        assert given[scope.name.lower()] == tokens.of(scope)
    assert [tokens.of(scope) for scope in Scope] == [load_tokens(path).of(each) for each in Scope]
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("given", ["", "0" * 32, "\ud800", "ä", "\0", "x" * 100_000])
def test_other_texts_are_no_token(given: str) -> None:
    tokens = Tokens({scope: str(scope.value) * 32 for scope in Scope})
    assert tokens.scope_of(given) is None


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o620, 0o602, 0o601])
def test_a_file_that_others_may_use_is_refused(mode: int, tmp_path: Path) -> None:
    path = tmp_path / "arm.tokens"
    load_tokens(path)
    path.chmod(mode)
    with pytest.raises(AccessError, match=f"mode {mode:04o}: others may use it"):
        load_tokens(path)


def test_a_file_of_another_user_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "arm.tokens"
    load_tokens(path)
    monkeypatch.setattr(os, "getuid", lambda: 12345)
    with pytest.raises(AccessError, match="belongs to user"):
        load_tokens(path)


VIEW, OPERATE, ADMIN = "a" * 32, "b" * 32, "c" * 32


@pytest.mark.parametrize(
    "text",
    [
        "",
        "null",
        "[]",
        "[" * 4000,
        "x" * 5000,
        "\xff",
        json.dumps({"view": VIEW, "operate": OPERATE}),
        json.dumps({"view": VIEW, "operate": OPERATE, "admin": ADMIN, "root": "d" * 32}),
        json.dumps({"view": VIEW, "operate": OPERATE, "admin": OPERATE}),
        json.dumps({"view": VIEW, "operate": OPERATE, "admin": "short"}),
        json.dumps({"view": VIEW, "operate": OPERATE, "admin": ""}),
        json.dumps({"view": VIEW, "operate": OPERATE, "admin": 5}),
    ],
)
def test_a_file_without_three_good_tokens_is_refused_and_not_quoted(
    text: str, tmp_path: Path
) -> None:
    path = tmp_path / "arm.tokens"
    path.write_bytes(text.encode("latin-1"))
    path.chmod(0o600)
    with pytest.raises(ConfigurationError) as caught:
        load_tokens(path)
    assert str(path) in str(caught.value)
    assert not any(token in str(caught.value) for token in (VIEW, OPERATE, ADMIN, "short"))


def test_a_path_that_is_no_file_is_refused(tmp_path: Path) -> None:
    goal = tmp_path / "goal"
    load_tokens(goal)
    link = tmp_path / "link"
    link.symlink_to(goal)
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe, 0o600)
    folder = tmp_path / "folder"
    folder.mkdir(0o700)
    for path in (link, pipe, folder, tmp_path / "absent" / "tokens", Path("/dev/null")):
        with pytest.raises((ConfigurationError, AccessError), match=str(path)):
            load_tokens(path)
