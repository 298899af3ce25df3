"""One file of a recording while it is written."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from mcap.writer import Writer

from bioscara.files.whole_files import AppendedFile
from bioscara.rosbag.topics import Topic, definition, quality_of_service

CHUNK = 64 << 10
"""Size of a chunk before it is compressed [byte]."""
PROFILE = "ros2"
MEDIA_TYPE = "application/octet-stream"
"""Media type of such a file: MCAP has none of its own."""


def is_being_written(path: Path) -> bool:
    """Return whether a process writes a file of this kind, which it has not finished then.

    Raises:
        OSError: The file cannot be read.
    """
    with path.open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
    return False


class _Output(AppendedFile):
    """The output of a writer."""

    def __init__(self, path: Path) -> None:
        super().__init__(path, 0o644)
        # Until it is closed, also by the end of the process: see is_being_written().
        fcntl.flock(self._file, fcntl.LOCK_EX)

    def tell(self) -> int:
        return self._size

    def flush(self) -> None:
        """Nothing waits here."""

    def sync(self) -> None:
        os.fsync(self._file)


class RecordingFile:
    """A file that takes messages, until :meth:`finish`.

    Args:
        path: The file; it must not exist.
        topics: The topics that it has.
        chunk: Size of a chunk before it is compressed [byte].

    Attributes:
        path: As given.

    Raises:
        OSError: It cannot be created or written.
    """

    def __init__(
        self, path: Path, topics: Iterable[Topic] = tuple(Topic), chunk: int = CHUNK
    ) -> None:
        self.path = path
        self._output = _Output(path)
        # Its parameter names more of a stream than it uses.
        self._writer = Writer(self._output, chunk_size=chunk)  # type: ignore[arg-type]
        try:
            self._writer.start(profile=PROFILE)
            self._channels = self._register(tuple(topics))
        except BaseException:
            self._output.close()
            path.unlink()
            raise

    def _register(self, topics: Sequence[Topic]) -> dict[Topic, int]:
        schemas = {
            name: self._writer.register_schema(name, "ros2msg", definition(name).encode())
            for name in dict.fromkeys(topic.type_name for topic in topics)
        }
        return {
            topic: self._writer.register_channel(
                topic.value,
                "cdr",
                schemas[topic.type_name],
                {"offered_qos_profiles": quality_of_service(latched=topic.latched)},
            )
            for topic in topics
        }

    @property
    def size(self) -> int:
        """Its size without the messages that wait for their chunk [byte]."""
        return self._output.tell()

    def add(self, topic: Topic, data: bytes, stamp: int, published: int | None = None) -> None:
        """Add a message.

        Args:
            topic: Its topic.
            data: The message as CDR.
            stamp: Time at which it is shown when the file is played [ns].
            published: Time that it is about [ns]; the same by default.

        Raises:
            OSError: The file cannot be written; it ends with its last complete record.
        """
        self._writer.add_message(
            self._channels[topic], stamp, data, stamp if published is None else published
        )

    def attach(self, name: str, media_type: str, data: bytes, stamp: int) -> None:
        """Add an attachment.

        Raises:
            OSError: As :meth:`add`.
        """
        self._writer.add_attachment(stamp, stamp, name, media_type, data)

    def describe(self, name: str, values: Mapping[str, str]) -> None:
        """Add metadata.

        Raises:
            OSError: As :meth:`add`.
        """
        self._writer.add_metadata(name, dict(values))

    def flush(self) -> None:
        """End the open chunk, so that the end of this process loses nothing of it.

        Raises:
            OSError: As :meth:`add`.
        """
        self._writer.flush()  # type: ignore[no-untyped-call]

    def sync(self) -> None:
        """Wait until all written records are on the disk.

        Raises:
            OSError: The disk failed.
        """
        self._output.sync()

    def finish(self) -> None:
        """Write the index and close the file.

        Raises:
            OSError: There is no room for the index; ``bioscara record recover`` makes one.
        """
        try:
            self._writer.finish()  # type: ignore[no-untyped-call]
            self._output.sync()
        finally:
            self._output.close()

    def abandon(self) -> None:
        """Close the file as it is, after an error."""
        self._output.close()
