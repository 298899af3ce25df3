"""Flight records that are attached to a recording, as files."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from mcap.records import Attachment
from mcap.writer import MCAP0_MAGIC

from bioscara.errors import RecordingError
from bioscara.printing import printable
from bioscara.robot.connection.evidence_folder import SUFFIX
from bioscara.whole_files import replacing


def unpack(attachments: Iterable[Attachment], folder: Path) -> list[Path]:
    """Write the flight records among the attachments of a recording into a folder.

    A file of that name stays: with the same content it is the flight record already.

    Args:
        attachments: The attachments.
        folder: The folder, which exists.

    Returns:
        The files.

    Raises:
        RecordingError: A name is no name of a file, or there is another file of that name.
        OSError: A file cannot be written.
    """
    files = []
    for attachment in attachments:
        if not attachment.data.startswith(MCAP0_MAGIC):
            continue
        path = folder / _required_name(attachment.name)
        if path.is_symlink() or path.exists():
            if path.is_symlink() or not path.is_file() or path.read_bytes() != attachment.data:
                raise RecordingError(
                    f"{printable(str(path))} exists and is not the flight record of this name; "
                    "give another folder"
                )
        else:
            with replacing(path) as partial:
                partial.write_bytes(attachment.data)
        files.append(path)
    return files


def _required_name(name: str) -> str:
    """Return a name from a recording; it comes from anywhere and must not leave the folder."""
    if not name.endswith(SUFFIX) or name.startswith(".") or not name.isprintable() or "/" in name:
        raise RecordingError(
            f"an attached flight record has the name {printable(name)!r}, which is no name of a "
            "file; it is not written"
        )
    return name
