"""Files with the data of one run of an owner."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import msgspec

from bioscara.api import messages as m
from bioscara.errors import ConfigurationError, RecordingError
from bioscara.hardware import Urdf
from bioscara.hardware.link_frames import LinkFrames
from bioscara.model.urdf import URDF, urdf_of
from bioscara.recording.content import DESCRIPTION, METADATA, OVERLAY, PARAMETERS, ArmStatus
from bioscara.recording.writing.arm_feed import ArmFeed, FeedItem
from bioscara.recording.writing.folder import RESERVE, RecordingFolder
from bioscara.recording.writing.rare_messages import (
    event_message,
    image_message,
    trajectory_message,
    transforms_message,
)
from bioscara.recording.writing.sample_messages import SampleMessages
from bioscara.recording.writing.wall_clock import WallClock
from bioscara.recording.writing.world_messages import WorldMessages
from bioscara.rosbag.recording_file import MEDIA_TYPE, RecordingFile
from bioscara.rosbag.texts import text_message
from bioscara.rosbag.topics import Topic
from bioscara.version import __version__

_FLUSH = 0.6
"""Longest time for which a message waits for its chunk [s]; a killed recorder loses no more."""
_SYNC = 0.5
"""Time between two waits for the disk [s]; a loss of power loses no more."""
_SECOND = 1e9

_encode = msgspec.json.Encoder().encode
_JSON_TOPICS: dict[type[m.Result], Topic] = {
    m.Statistics: Topic.STATISTICS,
    m.FaultList: Topic.FAULTS,
    m.WorkspaceState: Topic.WORKSPACE,
}


@dataclass(frozen=True, slots=True)
class FileLimits:
    """When the next file begins.

    Attributes:
        size: Size that a file may reach [byte].
        duration: Time on the arm's clock that a file may hold [s].
    """

    size: int
    duration: float


class OwnerRecorder:
    """Writes the items of one run of an owner, into one file after another.

    Args:
        feed: Its items.
        folder: Where the files are written.
        limits: When the next file begins.
        announce: Receives a sentence on each file.
    """

    def __init__(
        self,
        feed: ArmFeed,
        folder: RecordingFolder,
        limits: FileLimits,
        announce: Callable[[str], object],
    ) -> None:
        self._feed, self._folder, self._limits = feed, folder, limits
        self._announce = announce
        self._file: RecordingFile | None = None
        self._files = 0
        first = feed.first
        self._cycle, self._now = -1, first.time
        self._time = WallClock(first.time)
        self._begin = self._stamp = self._time.stamp(first.time)
        self._status: ArmStatus | None = None
        self._latched: dict[Topic, bytes] = {}
        self._evidence: set[str] = set()
        self._attachments: dict[str, tuple[str, str]] = {}
        self._messages = SampleMessages(first.names, self._describe())
        self._world = WorldMessages()
        self._flushed = self._synced = time.monotonic()
        # No file yet: these values are kept for the begin of each file.
        for item in (first, *feed.standing):
            self._write(item)

    def step(self) -> None:
        """Write the new items, and begin the next file if this one is large or long enough.

        Raises:
            RecordingError: The disk is full or cannot be written.
        """
        self._take(last=False)

    def close(self) -> None:
        """Write the rest and finish the file.

        Raises:
            RecordingError: The disk is full or cannot be written.
        """
        self._take(last=True)

    def _take(self, *, last: bool) -> None:
        try:
            self._file = self._file or self._next_file()
            for item in self._feed.take():
                self._write(item)
            if not last:
                self._flush()
            long = self._stamp - self._begin >= self._limits.duration * _SECOND
            if last or long or self._file.size >= self._limits.size:
                self._finish()
        except OSError as error:
            raise self._failed(error) from error

    def _failed(self, error: OSError) -> RecordingError:
        """Give the file up as it is: it ends with its last complete record."""
        file, self._file = self._file, None
        if file is None:
            reason = error.strerror or str(error)
            return RecordingError(f"{self._folder.path} cannot be written: {reason}")
        file.abandon()
        return self._unusable(file, error)

    @staticmethod
    def _unusable(file: RecordingFile, error: OSError) -> RecordingError:
        return RecordingError(
            f"{file.path} cannot be written: {error.strerror or error}; make room, then "
            f"'bioscara record recover {file.path}' completes it"
        )

    def _flush(self) -> None:
        now = time.monotonic()
        if self._file is None or now < self._flushed + _FLUSH:
            return
        self._flushed = now
        self._file.flush()
        if now >= self._synced + _SYNC:
            self._synced = now
            self._file.sync()
            self._delete_oldest()
            if (room := self._folder.room()) <= 0:
                path = self._file.path
                self._finish()
                raise self._no_room(f"{path} is complete", room)

    def _delete_oldest(self) -> None:
        written = None if self._file is None else self._file.path
        for deleted in self._folder.delete_oldest(written):
            self._announce(f"deleted {deleted}: all together are larger than --keep")

    @staticmethod
    def _no_room(what: str, room: int) -> RecordingError:
        return RecordingError(
            f"the disk is full: {what}, and {(RESERVE + room) / 1e6:.0f} MB are left, of which "
            f"recordings leave {RESERVE / 1e6:.0f} MB to others; make room, or give --keep"
        )

    def _write(self, item: FeedItem) -> None:
        match item:
            case m.StateSample():
                self._write_sample(item)
            case m.WorldSample():
                stamp = self._time.stamp(item.time)
                self._add_all(self._world.encode(item, stamp), stamp)
                self._messages.jaws = self._world.width
            case m.BodyList():
                self._add_all(self._world.begin(item, self._stamp), self._stamp)
            case m.ImageFile():
                stamp = self._time.stamp(item.time)
                self._add(Topic.IMAGE, image_message(item, stamp), stamp)
            case m.Event():
                self._write_event(item)
            case m.GoalTrajectories():
                for number, trajectory in enumerate(item.trajectories, 1):
                    name = f"goal {item.goal}, part {number}"
                    data = trajectory_message(trajectory, name, self._stamp)
                    self._add(Topic.TRAJECTORIES, data, self._stamp)
            case m.FlightRecordFile():
                if self._file is not None:
                    self._file.attach(item.name, MEDIA_TYPE, item.data, self._stamp)
            case m.ParametersState():
                self._attachments[OVERLAY] = ("application/yaml", item.overlay)
            case _:
                data = text_message(_encode(item).decode())
                self._add(_JSON_TOPICS[type(item)], data, self._stamp)
                if isinstance(item, m.FaultList):
                    self._ask_for_evidence(item.faults)

    def _ask_for_evidence(self, faults: Iterable[m.FaultValue]) -> None:
        """Ask for the flight records that are not attached yet."""
        for fault in faults:
            if fault.evidence is not None and fault.evidence not in self._evidence:
                self._evidence.add(fault.evidence)
                self._feed.ask(m.GetFlightRecord(fault.evidence))

    def _add_all(self, messages: Iterable[tuple[Topic, bytes]], stamp: int) -> None:
        for topic, data in messages:
            self._add(topic, data, stamp)

    def _add(self, topic: Topic, data: bytes, stamp: int, published: int | None = None) -> None:
        if topic.latched:
            self._latched[topic] = data
        if self._file is not None:
            self._file.add(topic, data, max(stamp, self._begin), published)

    def _write_sample(self, sample: m.StateSample) -> None:
        if sample.cycle <= self._cycle:
            return
        self._cycle, self._now = sample.cycle, sample.time
        stamp = self._stamp = self._time.stamp(sample.time)
        status = ArmStatus(
            sample.enabled,
            sample.fault.value,
            sample.paused,
            sample.speed_override,
            sample.moving,
            sample.stale,
        )
        if status != self._status:
            if self._status is not None and status.fault != self._status.fault:
                self._feed.ask(m.GetFaults())
            self._status = status
            self._add(Topic.STATUS, text_message(_encode(status).decode()), stamp)
        self._add_all(self._messages.encode(sample, stamp), stamp)

    def _write_event(self, event: m.Event) -> None:
        stamp = self._time.stamp(event.time)
        self._add(Topic.EVENTS, text_message(_encode(event).decode()), stamp, stamp)
        self._add(Topic.LOG, event_message(event, self._feed.description.name, stamp), stamp, stamp)
        # A program may have recovered before the list of faults was asked for.
        if event.fault is not None and event.number > self._feed.welcome.last_event:
            self._ask_for_evidence((event.fault,))

    def _next_file(self) -> RecordingFile:
        """Begin a file with the values that hold at its begin.

        Raises:
            RecordingError: There is no room for it.
            OSError: The folder cannot be written.
        """
        feed, folder = self._feed, self._folder
        path = folder.new_path()
        self._delete_oldest()
        if (room := folder.room()) <= 0:
            raise self._no_room(f"no file is begun in {folder.path}", room)
        if self._files > 0:
            self._time.renew(self._now)
        self._begin = self._stamp = self._time.stamp(self._now)
        self._files += 1
        self._file = file = RecordingFile(path)
        file.describe(
            METADATA,
            {
                "owner": feed.welcome.owner,
                "instance": feed.welcome.instance,
                "arm": feed.welcome.arm,
                "number": str(self._files),
                "software": feed.description.software,
                "recorder": __version__,
            },
        )
        for name, (media_type, text) in self._attachments.items():
            if text:
                file.attach(name, media_type, text.encode(), self._begin)
        for topic, data in self._latched.items():
            file.add(topic, data, self._begin)
        self._add_all(self._world.standing(self._begin), self._begin)
        file.flush()
        file.sync()
        folder.sync()
        self._announce(f"recording {path}")
        return file

    def _finish(self) -> None:
        file, self._file = self._file, None
        if file is not None:
            try:
                file.finish()
            except OSError as error:
                raise self._unusable(file, error) from error

    def _describe(self) -> LinkFrames | None:
        """Keep the description for the begin of each file; return its links."""
        description = self._feed.description
        parameters = _encode(description).decode()
        self._latched[Topic.PARAMETERS] = text_message(parameters)
        self._attachments[PARAMETERS] = ("application/json", parameters)
        try:
            urdf = urdf_of(description.parameters)
        except ConfigurationError as error:
            self._announce(f"without robot description and transforms: {error}")
            return None
        self._latched[Topic.ROBOT_DESCRIPTION] = text_message(urdf)
        self._attachments[DESCRIPTION] = ("application/xml", urdf)
        frames = LinkFrames(Urdf(urdf, URDF.name))
        self._latched[Topic.TF_STATIC] = transforms_message(frames.fixed, self._stamp)
        return frames
