"""A served arm whose recording the tests make, and how they read it: by mcap's own reader."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event as Flag, Thread
from typing import Any, NamedTuple

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from bioscara import Robot
from bioscara.physics.camera import CameraView
from bioscara.recording.reading.scan import FileScan, messages
from bioscara.recording.writing.folder import RecordingFolder
from bioscara.recording.writing.owner_recorder import FileLimits
from bioscara.recording.writing.recorder import record
from bioscara.server.serve import Served, ServeSettings, serving
from programs import wait_until

NAME = "left"
PLENTY = FileLimits(10**9, 3600.0)


class Read(NamedTuple):
    """A message as the libraries of MCAP and ROS 2 read it."""

    topic: str
    type_name: str
    log_time: int
    publish_time: int
    message: Any


@contextmanager
def served(folder: Path, speed: float = 20.0, rate: int = 100) -> Iterator[Served]:
    """Serve a simulated arm."""
    settings = ServeSettings(NAME, "sim", evidence=folder / "faults", real_time_factor=speed)
    with serving(Robot.simulated(evidence=folder / "faults", rate=rate), settings) as owner:
        yield owner


class Recording:
    """A recorder in a thread.

    Attributes:
        said: Its announcements.
        error: Cause of its end; None if the test did.
    """

    def __init__(
        self, folder: Path, limits: FileLimits, keep: int, view: CameraView | None = None
    ) -> None:
        self.folder = RecordingFolder(folder, NAME, keep)
        self.said: list[str] = []
        self.error: Exception | None = None
        self._ended = Flag()
        self._thread = Thread(target=self._run, args=(limits, view))
        self._thread.start()

    def _run(self, limits: FileLimits, view: CameraView | None) -> None:
        try:
            record(NAME, self.folder, limits, self._ended.is_set, self.said.append, view)
        except Exception as error:  # noqa: BLE001  for the test to see
            self.error = error

    @property
    def running(self) -> bool:
        return self._thread.is_alive()

    def heard(self, words: str) -> bool:
        return any(words in sentence for sentence in self.said)

    def end(self) -> list[Path]:
        """End it; return its files."""
        self._ended.set()
        self._thread.join()
        return [*self.folder.files()]


@contextmanager
def recording(folder: Path, limits: FileLimits = PLENTY, keep: int = 10**9) -> Iterator[Recording]:
    """Record the arm; the block begins when the first file has."""
    made = Recording(folder, limits, keep)
    try:
        wait_until(lambda: made.said != [] or not made.running, "the recorder begins")
        yield made
    finally:
        made.end()


def attached(recorder: Recording) -> dict[str, bytes]:
    """Return the attached flight records, also of a file that is being written."""
    scan = FileScan()
    list(messages(recorder.folder.files()[-1], scan, ()))
    return {each.name: each.data for each in scan.attachments if each.name.startswith("fault-")}


def recorded_fault(folder: Path) -> tuple[Path, Path]:
    """Record an arm that has a fault; return the recording, and the evidence of the fault."""
    with served(folder) as owner, recording(folder) as recorder:
        with Robot.connect(f"arm:{NAME}") as robot:
            robot.enable()
            owner.robot.simulate_fault("reset", "j3")
            wait_until(lambda: robot.faults != (), "the fault")
            (fault,) = robot.acknowledge()
            assert fault.evidence is not None
            wait_until(lambda: attached(recorder) != {}, "the evidence")
        (path,) = recorder.end()
    evidence = folder / "faults" / fault.evidence.name
    assert attached(recorder) == {evidence.name: evidence.read_bytes()}
    return path, evidence


def read(path: Path, *topics: str) -> list[Read]:
    """Return the messages of a complete file, or those of some topics."""
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        return [
            Read(channel.topic, schema.name, stored.log_time, stored.publish_time, message)
            for schema, channel, stored, message in reader.iter_decoded_messages(topics or None)
            if schema is not None
        ]
