"""Exchanges with several joints in one bus call: setpoints or velocities, answered by samples.

A joint that fails does not hide the answers of the others: each has its entry in the result, a
:class:`~bioscara.drivers.JointSample` or the exception raised for it. One or two bad cycles in a
row are bridged with the last sample, marked STALE; the third in a row is a
:class:`~bioscara.errors.JointLostError`. So is the first in which a version 1 joint does not
acknowledge; it gets no more cyclic frames until a separate exchange with it succeeds.
"""

from __future__ import annotations

from collections.abc import Sequence

from bioscara.arguments import items
from bioscara.bus import Bus, Transaction
from bioscara.clock import Clock
from bioscara.drivers.joint.cyclic import Outcome
from bioscara.drivers.joint.joint import Joint
from bioscara.drivers.joint.sample import JointSample, Setpoint
from bioscara.drivers.link.errors import exchange_failed
from bioscara.errors import (
    BioscaraError,
    CommunicationError,
    InvalidArgumentError,
    JointError,
    LimitError,
    NoAcknowledgeError,
)

Frames = list[tuple[Transaction, ...]]
_NO_OUTCOME = BioscaraError("no exchange yet")


def read_states(joints: Sequence[Joint], *, retry: bool = False) -> list[Outcome]:
    """Request the state of all joints in one bus call.

    Args:
        joints: Initialised joints of one bus.
        retry: Repeat the failed requests once within this cycle, in one more bus call.

    Returns:
        One entry per joint, in order.

    Raises:
        BusUnavailableError: The bus as a whole cannot be used.
    """
    outcomes: list[Outcome] = [_NO_OUTCOME] * len(joints)
    frames: Frames = []
    for index, joint in enumerate(joints):
        try:
            joint.session.require_open()
        except JointError as error:
            outcomes[index] = error
            frames.append(())
        else:
            frames.append(joint.cycle.state())
    return _exchange(joints, frames, outcomes, retry)


def track(
    joints: Sequence[Joint], setpoints: Sequence[Setpoint], *, retry: bool = False
) -> list[Outcome]:
    """Send all joints their setpoints and request their state, in one bus call.

    Each setpoint is the joint's target one cycle from now. All are checked before anything is sent.
    A joint that cannot move is sent nothing and its entry is the reason.

    Args:
        joints: Initialised joints of one bus.
        setpoints: One per joint, in order.
        retry: Repeat failed exchanges once within this cycle, in one more bus call; the joint
            executes no setpoint twice.

    Returns:
        One entry per joint, in order.

    Raises:
        LimitError: A setpoint is outside its joint's limits; nothing was sent to any joint.
        InvalidArgumentError: A setpoint is not finite, or there is not one per joint.
        BusUnavailableError: The bus as a whole cannot be used.
    """
    setpoints = items("the setpoints", setpoints, "give one for each joint")
    if len(setpoints) != len(joints):
        raise InvalidArgumentError(f"{len(setpoints)} setpoints for {len(joints)} joints")
    checked = [joint.limits.check_setpoint(setpoints[index]) for index, joint in enumerate(joints)]
    outcomes: list[Outcome] = [_NO_OUTCOME] * len(joints)
    frames: Frames = []
    for index, joint in enumerate(joints):
        if joint.limits.returning:
            joint.limits.start_from(checked[index].position)
        if joint.readiness.is_ready():
            frames.append(joint.cycle.track(checked[index]))
            continue
        try:
            joint.readiness.require_ready()
        except (CommunicationError, JointError) as error:
            outcomes[index] = error
        frames.append(())
    return _exchange(joints, frames, outcomes, retry)


def drive(
    joints: Sequence[Joint], velocities: Sequence[float], *, retry: bool = False
) -> list[Outcome]:
    """Send all joints their velocities in one bus call; they answer with their flags.

    A velocity holds for as long as it is repeated, see :meth:`Joint.set_velocity`. All are
    checked before anything is sent. A joint that, by its last sample, could not stop before a
    limit is stopped instead, and its entry is the :class:`~bioscara.errors.LimitError`; so call
    :func:`read_states` in every cycle. A joint that cannot move is sent nothing and its entry is
    the reason.

    Args:
        joints: Initialised joints of one bus.
        velocities: One per joint, in order [rad/s or m/s].
        retry: As for :func:`track`.

    Returns:
        One entry per joint, in order; samples are the last ones with new flags.

    Raises:
        LimitError: A velocity is above its joint's limit; nothing was sent to any joint.
        InvalidArgumentError: A velocity is not finite, or there is not one per joint.
        BusUnavailableError: The bus as a whole cannot be used.
    """
    velocities = items("the velocities", velocities, "give one for each joint")
    if len(velocities) != len(joints):
        raise InvalidArgumentError(f"{len(velocities)} velocities for {len(joints)} joints")
    velocities = [
        joint.limits.check_velocity(velocity)
        for joint, velocity in zip(joints, velocities, strict=True)
    ]
    outcomes: list[Outcome] = [_NO_OUTCOME] * len(joints)
    refused: dict[int, LimitError] = {}
    frames: Frames = []
    for index, (joint, velocity) in enumerate(zip(joints, velocities, strict=True)):
        try:
            if not joint.readiness.is_ready():
                joint.readiness.require_ready()
            if velocity:
                joint.limits.check_stopping(
                    velocity, joint.last, joint.clock.now(), joint.settings.max_acceleration
                )
        except LimitError as error:
            refused[index] = error
            frames.append(joint.cycle.stop())
        except (CommunicationError, JointError) as error:
            outcomes[index] = error
            frames.append(())
        else:
            frames.append(joint.cycle.drive(velocity))
    outcomes = _exchange(joints, frames, outcomes, retry)
    for index, reason in refused.items():
        outcomes[index] = reason
    return outcomes


def _exchange(
    joints: Sequence[Joint], frames: Frames, outcomes: list[Outcome], retry: bool
) -> list[Outcome]:
    if not joints:
        return []
    bus, clock = joints[0].bus, joints[0].clock
    waiting: list[int] = []
    requests: list[Transaction] = []
    for index, joint in enumerate(joints):
        if joint.bus is not bus:
            raise InvalidArgumentError(f"{joint.name} is on another bus than {joints[0].name}")
        if not frames[index]:
            continue
        if joint.session.version == 1:
            # It may need a pause of more than a cycle.
            timing = joint.session.timing
            if timing.silent:
                missing = NoAcknowledgeError("no device acknowledged", joint.parameters.address)
                outcomes[index] = joint.cycle.hold_last_sample(missing)
                continue
            if joint.session.paused:
                outcomes[index] = joint.cycle.skip()
                continue
        waiting.append(index)
        requests += frames[index]
    bad = _transfer(bus, clock, joints, requests, waiting, outcomes, retry)
    if bad and retry:
        again = [index for index, _ in bad]
        requests = [request for index in again for request in joints[index].cycle.again()]
        bad = _transfer(bus, clock, joints, requests, again, outcomes, False)
    for index, problem in bad:
        outcomes[index] = joints[index].cycle.hold_last_sample(problem)
    return outcomes


def _transfer(
    bus: Bus,
    clock: Clock,
    joints: Sequence[Joint],
    requests: Sequence[Transaction],
    waiting: Sequence[int],
    outcomes: list[Outcome],
    again: bool,
) -> list[tuple[int, CommunicationError]]:
    """Transfer the requests to the waiting joints in one call and record the outcomes.

    Returns:
        The joints whose exchange failed, each with its error; a repetition may succeed.
    """
    bad: list[tuple[int, CommunicationError]] = []
    results = iter(bus.transfer(requests) if requests else ())
    stamp = clock.now()
    for index in waiting:
        outcomes[index] = outcome = joints[index].cycle.take(results, stamp, again)
        if type(outcome) is not JointSample and exchange_failed(outcome):
            bad.append((index, outcome))
    return bad
