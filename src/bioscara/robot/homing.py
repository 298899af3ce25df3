"""Homing one joint after the other, watched, and cancellable at any time."""

from __future__ import annotations

from collections.abc import Sequence

from bioscara.drivers import Joint, JointSample
from bioscara.errors import MotionCancelledError
from bioscara.robot.records import Cancelled, Recorder


def home_in_order(joints: Sequence[Joint], recorder: Recorder, cancelled: Cancelled) -> None:
    """Home ``joints`` one at a time; each holds its place afterwards, a lift must not sink.

    Args:
        joints: The joints to home, in this order.
        recorder: Takes a record at each look at the joint that is homing.
        cancelled: Asked at each look.

    Raises:
        MotionCancelledError: It was asked to end; the joint was stopped.
        HomingError: A joint found no home that can be trusted.
        BioscaraError: As the drivers.
    """

    def progress(_: JointSample) -> None:
        recorder.record_last()

    for joint in joints:
        if cancelled():
            raise MotionCancelledError(f"interrupted before homing {joint.name}")
        try:
            joint.home(progress=progress, cancel=cancelled)
        except MotionCancelledError as error:
            raise MotionCancelledError(f"interrupted while homing {joint.name}") from error
        recorder.record_last()
