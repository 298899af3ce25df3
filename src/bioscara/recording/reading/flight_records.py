"""Flight records that are attached to a recording, as files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from mcap.records import Attachment
from mcap.writer import MCAP0_MAGIC

from bioscara.errors import RecordingError
from bioscara.files.whole_files import replacing
from bioscara.printing import printable
from bioscara.robot.connection.evidence_folder import SUFFIX


def flight_records(attachments: Iterable[Attachment], folder: Path) -> dict[Path, bytes]:
    """Return the flight records among the attachments of a recording, by their files.

    Nothing is written: a caller learns first whether :func:`unpack` would be refused.

    Args:
        attachments: The attachments.
        folder: The folder of the files; it need not exist.

    Raises:
        RecordingError: A name is no name of a file, or two flight records have it, or there is
            another file of that name.
        OSError: A file cannot be read.
    """
    records: dict[Path, bytes] = {}
    for attachment in attachments:
        if not attachment.data.startswith(MCAP0_MAGIC):
            continue
        path = folder / _required_name(attachment.name)
        if records.setdefault(path, attachment.data) != attachment.data:
            raise RecordingError(f"two attached flight records have the name {attachment.name}")
        _is_there(path, attachment.data)
    return records


def unpack(records: Mapping[Path, bytes]) -> list[Path]:
    """Write flight records into a folder.

    A file of that name stays: with the same content it is the flight record already.

    Args:
        records: Those of :func:`flight_records`; the folder exists.

    Returns:
        The files.

    Raises:
        RecordingError: There is another file of that name.
        OSError: A file cannot be written.
    """
    for path, data in records.items():
        if not _is_there(path, data):
            with replacing(path) as partial:
                partial.write_bytes(data)
    return list(records)


def _is_there(path: Path, data: bytes) -> bool:
    """Return whether a flight record is in its file already; refuse another file."""
    if not (path.is_symlink() or path.exists()):
        return False
    if path.is_symlink() or not path.is_file() or path.read_bytes() != data:
        raise RecordingError(
            f"{printable(str(path))} exists and is not the flight record of this name; "
            "give another folder"
        )
    return True


def _required_name(name: str) -> str:
    """Return a name from a recording; it comes from anywhere and must not leave the folder."""
    if not name.endswith(SUFFIX) or name.startswith(".") or not name.isprintable() or "/" in name:
        raise RecordingError(
            f"an attached flight record has the name {printable(name)!r}, which is no name of a "
            "file; it is not written"
        )
    return name
