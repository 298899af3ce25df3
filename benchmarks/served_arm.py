"""An arm that is served in a process of its own, for the benchmarks of the owner's clients.

Each line of its input is a word: ``mark`` begins a new list of cycles, ``cycles`` prints the list
as JSON, ``zenoh`` publishes messages for comparison, ``end`` ends the process. A cycle is the time
at its end on the machine's monotonic clock [s], the commanded speed of j1 [rad/s], its commanded
position before that is averaged over the periods of the belts [rad], and the time since 1970 [s] in
the sample of controllers, NaN where no client wants that.
"""

from __future__ import annotations

import json
import math
import sys
import time
from contextlib import ExitStack

import zenoh

from bioscara import Robot
from bioscara.control.loop.loop import CycleReport
from bioscara.server.owner import Owner
from bioscara.server.serve import ServeSettings, serving


class Cycles:
    """The cycles since the mark.

    Args:
        robot: The arm, which is served.
        owner: Its owner.
    """

    def __init__(self, robot: Robot, owner: Owner) -> None:
        self.rows: list[tuple[float, float, float, float]] = []
        self._owner, self._end = owner, math.nan
        self._guard = robot.runner.arm.stack.manager.limiter.joints["j1"]
        robot.runner.observers = (self._begin, *robot.runner.observers, self._append)

    def _begin(self, _: CycleReport) -> None:
        self._end = time.monotonic()

    def _append(self, _: CycleReport) -> None:
        """Append the cycle, of which the owner has a sample now."""
        sample, guard = self._owner.controllers_sample, self._guard
        wall = math.nan if sample is None else sample.wall
        self.rows.append((self._end, guard.speed, guard.reference + guard.lag, wall))


def main(name: str, topic: str, speed: str) -> None:
    """Serve an arm of this name until ``end``; a sample a cycle also goes to a topic of Zenoh."""
    robot = Robot.simulated().open()
    robot.home()
    robot.unfold()
    robot.enable()
    with ExitStack() as stack:
        publisher = (
            stack.enter_context(_session(topic)).declare_publisher("state") if topic else None
        )
        settings = ServeSettings(name, "sim", real_time_factor=float(speed))
        served = stack.enter_context(serving(robot, settings))
        cycles = Cycles(robot, served.owner)
        print(json.dumps({"rate": robot.runner.arm.stack.loop.rate}), flush=True)
        for line in sys.stdin:
            word = line.strip()
            if word == "mark":
                cycles.rows.clear()
            elif word == "cycles":
                print(json.dumps(cycles.rows), flush=True)
            elif word == "zenoh" and publisher is not None:
                _publish(publisher, served.owner.sample)
            elif word == "end":
                return


def _session(topic: str) -> zenoh.Session:
    config = zenoh.Config.from_json5(
        '{mode: "peer", scouting: {multicast: {enabled: false}},'
        f'listen: {{endpoints: ["unixsock-stream/{topic}"]}}}}'
    )
    return zenoh.open(config)


def _publish(publisher: zenoh.Publisher, sample: object) -> None:
    """Publish as many bytes as a sample has, 300 times at 100 Hz, each with its time."""
    from bioscara.api import framing  # noqa: PLC0415

    size = len(framing.encode_packed(sample))
    due = time.monotonic()
    for _ in range(300):
        due += 0.01
        time.sleep(max(due - time.monotonic(), 0.0))
        publisher.put(f"{time.monotonic():.9f}".ljust(size).encode())


if __name__ == "__main__":
    main(*sys.argv[1:])
