"""The node of ROS 2: joint states, commands, load of the processor, memory, its sudden end."""

from __future__ import annotations

import math
import os
import random
import signal
import time
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pytest

from benchmarks.measure import Row, at_most, duration
from benchmarks.owner_process import Arm, Array, served
from benchmarks.ros_processes import (
    BROADCASTER,
    FOLLOWER,
    NAME,
    STREAM,
    Program,
    Rig,
    node,
    program,
    rig,
)
from benchmarks.server import Client, by_chance
from bioscara.api import messages as m, runtime

TURNS, MESSAGES = 4, 500
"""Turns of the node and a bare publisher, and messages of each in a turn."""
GOALS = 20
STREAMS, STREAMED = 8, 100
"""Streams, each with another phase to the loop, and commands in each."""
STEP = 1e-4
"""Difference between two streamed positions: so small that no limit changes them [rad]."""
LIVES, SECONDS = 3, 3.0
"""Nodes that are stopped and killed, and the time for which the loop is observed each time [s]."""
SPEED, WARM, OBSERVED = 10.0, 20, 60
"""Factor by which time is faster while memory is observed, the time until buffers are full, and
the time for which memory is observed after that [s]."""


class Heard(NamedTuple):
    """The messages that a subscriber has received.

    Attributes:
        jitter: Deviation of each interval between two messages [s].
        latency: Of each message [s].
        share: Share of a core that the publisher used.
    """

    jitter: Array
    latency: Array
    share: float


def _own(arm: Arm, client: Program, process: int) -> Heard:
    """Listen to the node; the latency begins at the end of the cycle of the sample."""
    arm.tell("mark")
    answer = client.do("listen", "/joint_states", MESSAGES, process)
    stamps, moments = np.array(answer["heard"]).T
    cycles = arm.cycles()
    cycles = cycles[~np.isnan(cycles[:, 3])]
    nearest = np.abs(cycles[:, 3][None, :] - stamps[:, None]).argmin(axis=1)
    return Heard(_jitter(moments), moments - cycles[nearest, 0], answer["share"])


def _bare(publisher: Program, client: Program) -> Heard:
    """Listen to the bare publisher, whose stamps are the begin."""
    publisher.do("on")
    answer = client.do("listen", "/bare", MESSAGES, publisher.number)
    publisher.do("off")
    stamps, moments = np.array(answer["heard"]).T
    return Heard(
        _jitter(moments), moments + time.time() - time.monotonic() - stamps, answer["share"]
    )


def _jitter(moments: Array) -> Array:
    return np.abs(np.diff(moments) - 0.01)


def _joint_states(arm: Arm, client: Program, publisher: Program, process: int) -> list[Row]:
    turns = [(_own(arm, client, process), _bare(publisher, client)) for _ in range(TURNS)]
    own, bare = (
        Heard(
            np.concatenate([each.jitter for each in column]),
            np.concatenate([each.latency for each in column]),
            float(np.mean([each.share for each in column])),
        )
        for column in zip(*turns, strict=True)
    )
    jitter, bare_jitter = (float(np.percentile(each.jitter, 99)) for each in (own, bare))
    latency, bare_latency = (float(np.median(each.latency)) for each in (own, bare))
    return [
        at_most(
            "joint states at 100 Hz in another process: deviation of their intervals, p99",
            jitter,
            3,
            bare_jitter,
            "a bare publisher of rclpy",
            _within(jitter, 2e-3),
        ),
        at_most(
            "joint states from the end of their cycle to the callback of a subscriber, median",
            latency,
            4,
            bare_latency,
            "a bare publisher of rclpy",
            f"{_within(latency, 1.5e-3)}; p99 {duration(float(np.percentile(own.latency, 99)))}",
        ),
        Row(
            "processor of the node with joint states and a trajectory controller at 100 Hz",
            f"{100 * own.share:.1f} % of a core ({own.share / bare.share:.1f} times)",
            f"a bare publisher of rclpy: {100 * bare.share:.1f} %",
            "at most 25 % of a core",
            own.share <= 0.25,
        ),
    ]


def _within(value: float, limit: float) -> str:
    return f"{'above' if value > limit else 'within'} {duration(limit)}"


def _goals(arm: Arm, client: Program, place: tuple[float, ...]) -> Row:
    """Measure from a goal in another process to the first setpoint that moves."""
    delays = []
    for number in range(GOALS):
        arm.tell("mark")
        sent = client.do("goal", FOLLOWER, _beside(place, 0.0 if number % 2 else 0.2), 0.8)
        ends, speeds, *_ = arm.cycles().T
        moving = (ends > sent) & (np.abs(speeds) > 1e-9)
        delays.append(float(ends[np.argmax(moving)] - sent))
        time.sleep(0.1 + 0.01 * random.random())
    p95, p50 = np.percentile(delays, (95, 50))
    return Row(
        "follow_joint_trajectory: from the goal in another process to the first setpoint, p95",
        f"{duration(p95)}, median {duration(p50)}, {GOALS} goals",
        "six cycles of 10 ms",
        "at most 1 time",
        bool(p95 <= 60e-3),
    )


def _streams(made: Rig, arm: Arm, client: Program, place: tuple[float, ...]) -> Row:
    """Measure from a position on a topic to the cycle that sends it."""
    delays: list[float] = []
    lost = 0
    first = list(place)
    # The first messages of a new publisher are lost until the subscription has found it.
    client.do("stream", STREAM, first, 0.0, STREAMED)
    for _ in range(STREAMS):
        time.sleep(0.2 + 0.01 * random.random())
        arm.tell("mark")
        sent = client.do("stream", STREAM, first, STEP, STREAMED)
        time.sleep(0.1)
        ends, _, setpoints, _ = arm.cycles().T
        for moment, position in sent:
            there = (ends > moment) & (setpoints > position - 0.5 * STEP)
            if there.any():
                delays.append(float(ends[np.argmax(there)] - moment))
            else:
                lost += 1
        first[0] = sent[-1][1]
    p95, p50 = np.percentile(delays, (95, 50)) if delays else (math.inf, math.inf)
    value = f"{duration(p95)}, median {duration(p50)}, {len(delays)} commands"
    if lost:
        # A computer that stands still for a second costs the lease, and with it all that follows.
        value += f"; {lost} were lost: {made.log.splitlines()[-1].replace('|', '/')}"
    return Row(
        "positions streamed at 100 Hz: from publishing to the end of their first cycle, p95",
        value,
        "a cycle of 10 ms and 3 ms",
        "at most 1 time",
        bool(p95 <= 13e-3) and not lost,
    )


def _beside(place: tuple[float, ...], distance: float) -> list[float]:
    """Return a place at which j1 is that distance nearer to its middle [rad]."""
    return [place[0] - math.copysign(distance, place[0]), *place[1:]]


def _sudden_ends(made: Rig, arm: Arm, client: Program, place: tuple[float, ...]) -> Row:
    """Stop and kill nodes that stream, and count the late cycles of the owner."""
    calm: list[float] = []
    disturbed: list[float] = []
    for _ in range(LIVES):
        with node(made, BROADCASTER, STREAM) as process:
            # Until after the kill; a node without a subscription has no stream.
            client.begin("stream", STREAM, place, 0.0, round(100 * (4.0 * SECONDS + 2.0)))
            time.sleep(1.0)
            for ending in (signal.SIGSTOP, signal.SIGKILL):
                calm += arm.lateness(SECONDS)
                disturbed += arm.lateness(SECONDS, lambda end=ending: process.send_signal(end))
                process.send_signal(signal.SIGCONT)
            process.wait()
            client.end()
    late, without = (sum(each > 0.01 for each in times) for times in (disturbed, calm))
    return Row(
        f"cycles of the owner that are late after {LIVES} SIGSTOP and {LIVES} SIGKILL of the node "
        "while it streams",
        f"{late} of {len(disturbed)}; latest {duration(max(disturbed))}",
        f"in turns, while it runs: {without} of {len(calm)}; latest {duration(max(calm))}",
        "no more than two standard deviations",
        bool(late <= without + by_chance(late, without)),
    )


def _memory(client: Program, process: int) -> Row:
    """Observe the memory of the node over many samples of an accelerated arm."""
    rows = np.array(client.do("count", "/joint_states", WARM + OBSERVED, process))[WARM:]
    messages, memory = rows.T
    growth = float(np.polyfit(messages, memory, 1)[0])
    million = 1e6 * growth / 2**20
    seen = messages[-1] - messages[0]
    return Row(
        "memory of the node, growth over a million cycles",
        f"{million:.1f} MiB, extrapolated from {seen:.0f} cycles; in them "
        f"{(memory[-1] - memory[0]) / 1024:.0f} KiB",
        f"the node, {memory[0] / 2**20:.0f} MiB",
        "at most 0.1 times",
        bool(1e6 * growth <= 0.1 * memory[0]),
    )


def rows() -> Iterator[Row]:
    """Measure the node, in the environment of ``make ros2``; without it a row says so."""
    try:
        with rig() as made:
            yield from _rows(made)
    except pytest.skip.Exception as reason:
        yield Row("the node", "not measured", str(reason), "none", True)


def _rows(made: Rig) -> Iterator[Row]:
    os.environ[runtime.VARIABLE] = str(made.folder)
    with program(made, "client") as client:
        with served(NAME) as arm:
            place = tuple(Client(NAME, "place").ask(m.GetState()).positions)
            with program(made, "publisher") as bare, node(made, BROADCASTER, FOLLOWER) as process:
                yield from _joint_states(arm, client, bare, process.pid)
                yield _goals(arm, client, place)
            with node(made, BROADCASTER, STREAM):
                yield _streams(made, arm, client, place)
            yield _sudden_ends(made, arm, client, place)
        with served(NAME, speed=SPEED), node(made, BROADCASTER, FOLLOWER) as process:
            yield _memory(client, process.pid)
