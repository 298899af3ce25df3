"""The files of the page, read once: no path of a request is ever looked up on the disk."""

from __future__ import annotations

import gzip
import hashlib
import posixpath
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib.resources import files
from importlib.resources.abc import Traversable

_TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
}
"""Media types by the end of the name; files with other ends are not served."""
_HEAD, _HEAD_FILE = b"<!-- head.part -->\n", "head.part"
"""Placeholder of a page for the head that all pages share, and the file that has it."""
_VERSION = b'data-assets=""'
"""Placeholder of a page for the version of its files."""
_SCRIPT = re.compile(rb'<script type="module" src="([^"]+)"></script>')
_IMPORT = re.compile(rb"""^(?:import|export|\}) (?:[^"]* from )?"(\.[^"]+)";$""", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Asset:
    """A file of the page.

    Attributes:
        path: Path at which it is served.
        media_type: Its media type.
        content: Its content.
        compressed: The same, compressed by gzip.
        tag: Changes with the content, for ``ETag``.
    """

    path: str
    media_type: str
    content: bytes
    compressed: bytes
    tag: str


def read_assets() -> tuple[str, dict[str, Asset]]:
    """Return the version of the files of the page, and the files by the paths that serve them.

    Each document has the head that all share and the version of all files in it, and names the
    modules that its script imports, so that the browser asks for all of them at once.
    """
    page = files("bioscara.dashboard") / "page"
    head = (page / _HEAD_FILE).read_bytes()
    contents = {path: content.replace(_HEAD, head) for path, content in _below(page, "/")}
    version = version_of(contents)
    named = f'data-assets="{version}"'.encode()
    assets = {}
    for path, content in contents.items():
        served = path
        if path.endswith(".html"):
            served = "/" if path == "/index.html" else path
            content = _preloading(content.replace(_VERSION, named), contents)  # noqa: PLW2901
        assets[served] = _asset(served, path, content)
    return version, assets


def version_of(contents: Mapping[str, bytes]) -> str:
    """Return a short hash of all files, by their paths: a page of another one is out of date."""
    digest = hashlib.sha256()
    for path in sorted(contents):
        digest.update(path.encode() + b"\0" + contents[path] + b"\0")
    return digest.hexdigest()[:16]


def _asset(served: str, path: str, content: bytes) -> Asset:
    media_type = _TYPES[_end_of(path)]
    tag = hashlib.sha256(content).hexdigest()[:16]
    return Asset(served, media_type, content, gzip.compress(content, 9, mtime=0), tag)


def _preloading(document: bytes, contents: Mapping[str, bytes]) -> bytes:
    """Return a document that names the modules which its script imports, before the script."""

    def named(script: re.Match[bytes]) -> bytes:
        begin = "/" + script[1].decode()
        links = [
            b'<link rel="modulepreload" href="%s">\n' % path.removeprefix("/").encode()
            for path in _imported(begin, contents)
            if path != begin
        ]
        return b"".join(links) + script[0]

    return _SCRIPT.sub(named, document)


def _imported(begin: str, contents: Mapping[str, bytes]) -> list[str]:
    """Return a module with all that it imports, those of the first step first."""
    found = [begin]
    for path in found:
        for name in _IMPORT.findall(contents.get(path, b"")):
            there = posixpath.normpath(posixpath.join(posixpath.dirname(path), name.decode()))
            if there in contents and there not in found:
                found.append(there)
    return found


def _below(folder: Traversable, path: str) -> Iterator[tuple[str, bytes]]:
    """Yield the files that are served, with their contents."""
    for each in sorted(folder.iterdir(), key=lambda each: each.name):
        if each.is_dir():
            yield from _below(each, f"{path}{each.name}/")
        elif _end_of(each.name) in _TYPES:
            yield f"{path}{each.name}", each.read_bytes()


def _end_of(name: str) -> str:
    return posixpath.splitext(name)[1]
