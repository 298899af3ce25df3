"""The files of the page, read once: no path of a request is ever looked up on the disk."""

from __future__ import annotations

import gzip
import hashlib
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


@dataclass(frozen=True, slots=True)
class Asset:
    """A file of the page.

    Attributes:
        path: Path at which it is served.
        media_type: Its media type.
        content: Its content.
        compressed: The same, compressed by gzip.
    """

    path: str
    media_type: str
    content: bytes
    compressed: bytes


def read_assets() -> dict[str, Asset]:
    """Return the files of the page by the paths at which they are served."""
    found = {asset.path: asset for asset in _below(files("bioscara.dashboard") / "page", "/")}
    found["/"] = found.pop("/index.html")
    return found


def version_of(assets: dict[str, Asset]) -> str:
    """Return a short hash of all files: a page of another one is out of date."""
    digest = hashlib.sha256()
    for path in sorted(assets):
        digest.update(path.encode() + b"\0" + assets[path].content)
    return digest.hexdigest()[:16]


def _below(folder: Traversable, path: str) -> list[Asset]:
    found = []
    for each in sorted(folder.iterdir(), key=lambda each: each.name):
        if each.is_dir():
            found += _below(each, f"{path}{each.name}/")
        elif media_type := _TYPES.get(f".{each.name.rpartition('.')[2]}"):
            content = each.read_bytes()
            if not each.name.endswith(".d.ts"):
                compressed = gzip.compress(content, 9, mtime=0)
                found.append(Asset(f"{path}{each.name}", media_type, content, compressed))
    return found
