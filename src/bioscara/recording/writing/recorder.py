"""Recording of a served arm until a request to end, through restarts of its owner."""

from __future__ import annotations

import time
from collections.abc import Callable

from bioscara.errors import OwnerLostError, RecordingError
from bioscara.physics.camera import CameraView
from bioscara.recording.writing.arm_feed import ArmFeed
from bioscara.recording.writing.folder import RecordingFolder
from bioscara.recording.writing.owner_recorder import FileLimits, OwnerRecorder

_PAUSE = 0.05
"""Pause between two batches [s]: samples are taken several at a time."""
_RETRY = 0.5
"""Pause between two attempts to find the owner [s]."""


def record(
    arm: str,
    folder: RecordingFolder,
    limits: FileLimits,
    ended: Callable[[], bool],
    announce: Callable[[str], object],
    view: CameraView | None = None,
) -> None:
    """Record an arm until ``ended``; while it has no owner, wait for one.

    Args:
        arm: Name of the owner.
        folder: Where the files are written.
        limits: When the next file begins.
        ended: Returns whether to end.
        announce: Receives a sentence on each file, and on an owner that is missing.
        view: Camera and size of images of its world; None for none.

    Raises:
        RecordingError: The disk is full or cannot be written; an event reports it to all clients.
        BioscaraError: The owner refuses this user, or speaks another version.
    """
    waiting = ""
    while not ended():
        try:
            feed = ArmFeed(arm, view)
        except OwnerLostError as error:
            if str(error) != waiting:
                waiting = str(error)
                announce(f"waiting: {waiting}")
            time.sleep(_RETRY)
            continue
        waiting = ""
        recorder = OwnerRecorder(feed, folder, limits, announce)
        try:
            while not (ended() or feed.lost):
                recorder.step()
                time.sleep(_PAUSE)
            lost = feed.lost
            feed.finish()
            recorder.close()
        except RecordingError as error:
            feed.report(f"the recording has stopped: {error}")
            raise
        finally:
            feed.close()
        if lost:
            announce(f"the file is complete: {lost}")
