"""The files of the service: where they are, what they contain, and writing all of them or none."""

from __future__ import annotations

import os
import re
import shlex
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

from bioscara.errors import ConfigurationError
from bioscara.extras import pip_install
from bioscara.files.whole_files import replacing
from bioscara.flashing.access import RULES

UNIT = Path("/etc/systemd/system/bioscara@.service")
USERS = Path("/etc/sysusers.d/bioscara.conf")
_WANTED = Path("/etc/systemd/system/multi-user.target.wants")
_CONFIGURATION = Path("/etc/bioscara")
_STATE = Path("/var/lib/bioscara")
_DATA = Path(__file__).parent
_SHARED = {
    UNIT: _DATA / "bioscara@.service",
    USERS: _DATA / "bioscara.sysusers",
    Path("/etc/tmpfiles.d/bioscara.conf"): _DATA / "bioscara.tmpfiles",
    Path("/etc/udev/rules.d/70-bioscara-devices.rules"): _DATA / "70-bioscara-devices.rules",
    Path("/etc/udev/rules.d") / RULES.name: RULES,
}
"""The files of all arms, and what is installed there."""
COPIED = {"--parameters": "parameters.yaml", "--table": "poses.yaml", "--scene": "scene.yaml"}
"""Options of ``serve`` whose files are in the state folder, where the service can write them."""
_LINE = re.compile(r"^BIOSCARA_OPTIONS=(.*)$", re.MULTILINE)
_HEADING = """\
# Arm {name}: the options of `bioscara serve`, in one line. Other variables of its environment may
# follow. After a change: sudo systemctl restart bioscara@{name}. A further `bioscara service
# install` replaces the options that it is given, and keeps all else.
"""
_HIDDEN = ("/home", "/root", "/run/user", "/tmp", "/var/tmp")  # noqa: S108  not used
"""Folders that the unit hides from the service: ProtectHome, PrivateTmp."""


class File(NamedTuple):
    """A file as it has to be.

    Attributes:
        path: The file, without the root.
        content: Its content.
    """

    path: Path
    content: bytes


def environment(name: str) -> Path:
    """Return the file with the options of an arm."""
    return _CONFIGURATION / f"{name}.env"


def state(name: str) -> Path:
    """Return the folder of what the owner of an arm writes: recordings, poses, its bench."""
    return _STATE / name


def unit(name: str) -> str:
    """Return the name of the unit of an arm."""
    return f"bioscara@{name}.service"


def within(root: Path, path: Path) -> Path:
    """Return where a file is, if ``root`` is the root of the file system."""
    return root / path.relative_to("/")


def hidden(path: Path | str) -> bool:
    """Return whether the service cannot see a path."""
    return any(Path(path).is_relative_to(folder) for folder in _HIDDEN)


def check_program(*, image: bool = False) -> None:
    """Raise unless the service can read the Python and the package that run.

    Args:
        image: Whether the service is for another computer: only the path that its unit starts is
            known then.

    Raises:
        ConfigurationError: It cannot; names the folder and the remedy.
    """
    package = _DATA.parent
    started = Path(sys.executable)
    here = () if image else (package, Path(sys.prefix), started.resolve(), Path(sys.base_prefix))
    for path in (started, *here):
        if hidden(path):
            clone = package.parent.parent
            source = str(clone) if (clone / "pyproject.toml").exists() else "bioscara"
            raise ConfigurationError(
                f"bioscara runs from {path}, which is hidden from services; install it elsewhere, "
                "and use that one: sudo python3 -m venv /opt/bioscara && sudo "
                f"{pip_install(f'{source}[web]', python='/opt/bioscara/bin/python')} && sudo "
                "/opt/bioscara/bin/bioscara service install ..."
            )


def shared_files(root: Path) -> list[File]:
    """Return the files that all arms have.

    Raises:
        ConfigurationError: Another file is in the place of one of them.
    """
    files = []
    for path, source in _SHARED.items():
        text = source.read_text().replace("@PYTHON@", shlex.quote(sys.executable))
        _require_own(root, path, text)
        files.append(File(path, text.encode()))
    return files


def installed(root: Path) -> list[str]:
    """Return the names of the arms that are installed."""
    return sorted(path.stem for path in within(root, _CONFIGURATION).glob("*.env"))


def removed_with(root: Path, name: str) -> list[Path]:
    """Return the files that are removed with an arm: its own, and with the last one all others.

    Raises:
        ConfigurationError: The arm is not installed, or a file is not that of this service.
    """
    others = installed(root)
    if name not in others:
        there = ", ".join(others) or "none"
        raise ConfigurationError(
            f"no service of arm {name} is installed: there is no "
            f"{within(root, environment(name))}; arms that are: {there}"
        )
    paths = []
    enabled = _WANTED / unit(name)
    # In an image: here systemctl removes it.
    if root != Path("/") and within(root, enabled).is_symlink():
        paths.append(enabled)
    if others == [name]:
        for path, source in _SHARED.items():
            if within(root, path).exists():
                _require_own(root, path, source.read_text())
                paths.append(path)
    # Last, so that a removal that fails can be repeated.
    return [*paths, environment(name)]


def remove(root: Path, paths: Sequence[Path]) -> None:
    """Remove files, and the folder of the options once it is empty.

    Raises:
        ConfigurationError: A file cannot be removed.
    """
    for path in paths:
        try:
            within(root, path).unlink(missing_ok=True)
        except OSError as error:
            raise ConfigurationError(
                f"{within(root, path)} cannot be removed: {error.strerror or error}; remove the "
                "cause and repeat it"
            ) from error
    with suppress(OSError):
        within(root, _CONFIGURATION).rmdir()


def read_options(root: Path, name: str) -> list[str] | None:
    """Return the options of an arm as words; None if it is not installed.

    Raises:
        ConfigurationError: They cannot be read.
    """
    path = within(root, environment(name))
    try:
        found = _LINE.search(path.read_text())
        text = found[1].strip() if found else ""
        if len(text) > 1 and text[0] == text[-1] == '"':
            text = text[1:-1]
        return shlex.split(text)
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as error:
        raise ConfigurationError(f"{path}: BIOSCARA_OPTIONS cannot be read: {error}") from error


def merged(words: Sequence[str], given: Mapping[str, Sequence[str]]) -> tuple[list[str], list[str]]:
    """Return options of which some are given anew, and the words that are kept.

    Args:
        words: The former options.
        given: By option its values; several if it is repeated.
    """
    kept, skip = [], False
    for word in words:
        named = word in given
        if not (skip or named or word.partition("=")[0] in given):
            kept.append(word)
        skip = named
    return [
        *(each for option, values in given.items() for value in values for each in (option, value)),
        *kept,
    ], kept


def environment_file(root: Path, name: str, words: Sequence[str]) -> File:
    """Return the file with the options of an arm; all else in it stays as it is.

    Raises:
        ConfigurationError: A word has a character that means something else to systemd.
    """
    for word in words:
        if found := re.search(r"""['"\\$%]|[^ -~]""", word):
            raise ConfigurationError(
                f"{word!r} cannot be an option of the service: it has {found[0]!r}, which systemd "
                "does not take literally"
            )
    line = f"BIOSCARA_OPTIONS={shlex.join(words)}"
    path = within(root, environment(name))
    text = path.read_text() if path.exists() else _HEADING.format(name=name)
    found = _LINE.search(text)
    text = f"{text}{line}\n" if not found else text[: found.start()] + line + text[found.end() :]
    return File(environment(name), text.encode())


def copied_file(root: Path, name: str, option: str, source: Path) -> list[File]:
    """Return the copy of a file for the service, and one of the different file that it replaces."""
    path, content = state(name) / COPIED[option], source.read_bytes()
    former = _content(within(root, path))
    if former is None or former == content:
        return [File(path, content)]
    return [File(path.with_name(f"{path.name}.bak"), former), File(path, content)]


def changed(root: Path, files: Sequence[File]) -> list[File]:
    """Return the files that are missing or have another content."""
    return [each for each in files if _content(within(root, each.path)) != each.content]


def write(root: Path, files: Sequence[File]) -> None:
    """Write files, which others may read; if one fails, all are as before.

    Raises:
        ConfigurationError: A file cannot be written.
    """
    written: list[tuple[Path, bytes | None]] = []
    with _usual_mask():
        try:
            for file in files:
                path = within(root, file.path)
                written.append((path, _content(path)))
                path.parent.mkdir(parents=True, exist_ok=True)
                _write(path, file.content)
        except OSError as error:
            for former, content in reversed(written):
                with suppress(OSError):
                    former.unlink() if content is None else _write(former, content)
            raise ConfigurationError(
                f"{path} cannot be written: {error.strerror or error}; nothing was installed"
            ) from error


@contextmanager
def _usual_mask() -> Iterator[None]:
    before = os.umask(0o022)
    try:
        yield
    finally:
        os.umask(before)


def _write(path: Path, content: bytes) -> None:
    with replacing(path) as new:
        new.write_bytes(content)
        # In the state folder, whose owner is the service once that has run.
        folder = path.parent.stat()
        os.chown(new, folder.st_uid, folder.st_gid)


def _content(path: Path) -> bytes | None:
    try:
        return path.read_bytes()
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        raise ConfigurationError(
            f"{path} cannot be read: {error.strerror or error}; nothing has changed"
        ) from error


def _require_own(root: Path, path: Path, text: str) -> None:
    """Raise if a file does not begin as the one that is installed there."""
    there = within(root, path)
    content = _content(there)
    if content is not None and content.splitlines()[:1] != text.encode().splitlines()[:1]:
        raise ConfigurationError(
            f"{there} was not written by bioscara service install; move it away, or keep using it "
            "without this command"
        )
