"""The tokens of a gateway, in a file that no other user can read."""

from __future__ import annotations

import os
import re
import secrets
import stat
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

import msgspec

from bioscara.api import runtime
from bioscara.errors import AccessError, ConfigurationError
from bioscara.files.regular_file import RegularFile
from bioscara.robot.tasks.scope import Scope

_BYTES = 16
"""Length of a token: 128 bits."""
_LONGEST = 4096
"""Longest file [byte]."""
_TOKEN = re.compile(r"[0-9a-f]{32,128}")


class Tokens:
    """A token for each scope, or for some."""

    def __init__(self, tokens: Mapping[Scope, str]) -> None:
        self._tokens = dict(tokens)

    def of(self, scope: Scope) -> str:
        """Return the token of a scope."""
        return self._tokens[scope]

    def scope_of(self, given: str) -> Scope | None:
        """Return the scope of a token; None if it is none. All are compared, in constant time."""
        found, wanted = None, given.encode(errors="surrogatepass")
        for scope, token in self._tokens.items():
            if secrets.compare_digest(wanted, token.encode()):
                found = scope
        return found


def view_token() -> Tokens:
    """Return a new token of scope ``view`` that no file has, and none of another scope."""
    return Tokens({Scope.VIEW: secrets.token_hex(_BYTES)})


def default_path(arm: str) -> Path:
    """Return the file with the tokens of an arm's gateway, next to the owner's socket."""
    return runtime.socket_of(arm).with_suffix(".tokens")


def load_tokens(path: Path) -> Tokens:
    """Return the tokens of a file; it is made, with new ones, if it does not exist.

    Raises:
        AccessError: Others can read or replace it.
        ConfigurationError: It has no three different tokens, or cannot be read or made.
    """
    try:
        with suppress(FileExistsError):
            return _made(path)
        return _read(path)
    except OSError as error:
        text = f"{path}: {error.strerror}; remove that, or name another file"
        raise ConfigurationError(text) from error


def _made(path: Path) -> Tokens:
    tokens = {scope: secrets.token_hex(_BYTES) for scope in Scope}
    text = msgspec.json.encode({scope.name.lower(): token for scope, token in tokens.items()})
    # Under another name first: another gateway that starts now must not read half of it.
    other = path.with_name(f"{path.name}.{secrets.token_hex(4)}")
    file = os.open(other, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
    try:
        with os.fdopen(file, "wb") as stream:
            stream.write(text + b"\n")
        os.link(other, path)
    finally:
        other.unlink()
    return Tokens(tokens)


def _read(path: Path) -> Tokens:
    text = read_private(path, _LONGEST)
    try:
        given = msgspec.json.decode(text, type=dict[str, str])
    except (msgspec.DecodeError, UnicodeError):
        given = {}
    names = [scope.name.lower() for scope in Scope]
    # The message names no content of the file: it may be logged.
    if (
        sorted(given) != sorted(names)
        or not all(_TOKEN.fullmatch(token) for token in given.values())
        or len(set(given.values())) != len(names)
    ):
        raise ConfigurationError(
            f"{path} has not the tokens {', '.join(names)}, three different ones of at least "
            f"{2 * _BYTES} hexadecimal digits; remove the file, and new ones are made"
        )
    return Tokens({scope: given[scope.name.lower()] for scope in Scope})


def read_private(path: Path, longest: int) -> bytes:
    """Return the content of a file that only this user can read.

    Args:
        path: The file.
        longest: Longest content that is accepted [byte].

    Raises:
        AccessError: It belongs to another user, or others can read or write it.
        ConfigurationError: It is longer.
        OSError: It cannot be read, or is no regular file.
    """
    with RegularFile(path).open() as stream:
        status = os.fstat(stream.fileno())
        if status.st_uid != os.getuid():
            raise AccessError(
                f"{path} belongs to user {status.st_uid}; name a file of user {os.getuid()}"
            )
        if mode := stat.S_IMODE(status.st_mode) & 0o077:
            raise AccessError(
                f"{path} has mode {stat.S_IMODE(status.st_mode):04o}: others may use it "
                f"({mode:03o}); its secrets may be known, so remove it, and a new one is made"
            )
        content = stream.read(longest + 1)
    if len(content) > longest:
        raise ConfigurationError(f"{path} is longer than {longest} bytes; name another file")
    return content
