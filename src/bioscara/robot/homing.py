"""Homing one joint after the other, watched, and cancellable at any time."""

from __future__ import annotations

from collections.abc import Sequence

from bioscara.clock import Clock
from bioscara.drivers import Joint
from bioscara.errors import MotionCancelledError
from bioscara.protocol import Flags
from bioscara.report import Phase
from bioscara.robot.records import Cancelled, Recorder

POLL = 0.04
"""Time between two looks at the joints [s]: a homing joint wants its host every 60 ms."""


def home_in_order(
    joints: Sequence[Joint],
    order: Sequence[str],
    clock: Clock,
    recorder: Recorder,
    cancelled: Cancelled,
) -> None:
    """Home the joints named in ``order``; each is disabled again when it is home.

    Args:
        joints: All joints, in the order of the recorder's samples.
        order: Names of the joints to home.
        clock: The arm's time.
        recorder: Takes a record at each look at the joints.
        cancelled: Asked at each look.

    Raises:
        MotionCancelledError: It was asked to end; a joint may still be moving.
        HomingError: A joint found no home that can be trusted.
        BioscaraError: As the drivers; a joint may still be moving.
    """
    names = [joint.name for joint in joints]
    for name in order:
        index = names.index(name)
        joint = joints[index]
        if cancelled():
            raise MotionCancelledError(f"interrupted before homing {name}")
        joint.start_homing()
        deadline = clock.now()
        while recorder.poll(Phase.HOMING)[index].flags & Flags.BUSY:
            if cancelled():
                raise MotionCancelledError(f"interrupted while homing {name}")
            deadline = max(deadline + POLL, clock.now())
            clock.sleep_until(deadline)
        joint.post_homing()
        joint.disable()
