"""An arm that is served in a process of its own, for the benchmarks of the owner.

Each line of its input is a word: ``mark`` begins a new list of cycles, ``cycles`` prints the list
as JSON, ``zenoh`` publishes messages for comparison, ``end`` ends the process. A cycle is the time
at its end on the machine's monotonic clock [s], and the commanded speed of j1 [rad/s].
"""

from __future__ import annotations

import json
import sys
import time

import zenoh

from bioscara import Robot
from bioscara.control.loop.loop import CycleReport
from bioscara.server.serve import ServeSettings, serving


def main(name: str, topic: str) -> None:
    """Serve an arm of this name until ``end``; a sample a cycle also goes to a topic of Zenoh."""
    robot = Robot.simulated().open()
    robot.home()
    robot.unfold()
    robot.enable()
    guard = robot.arm.stack.manager.limiter.joints["j1"]
    cycles: list[tuple[float, float]] = []
    loop = robot.arm.stack.loop

    def observe(_: CycleReport) -> None:
        cycles.append((time.monotonic(), guard.speed))

    config = zenoh.Config.from_json5(
        '{mode: "peer", scouting: {multicast: {enabled: false}},'
        f'listen: {{endpoints: ["unixsock-stream/{topic}"]}}}}'
    )
    with zenoh.open(config) as session, serving(robot, ServeSettings(name, "sim")) as served:
        publisher = session.declare_publisher("state")
        robot.arm.observers = (observe, *robot.arm.observers)
        print(json.dumps({"rate": loop.rate}), flush=True)
        for line in sys.stdin:
            word = line.strip()
            if word == "mark":
                cycles.clear()
            elif word == "cycles":
                print(json.dumps(cycles), flush=True)
            elif word == "zenoh":
                _publish(publisher, served.owner.sample)
            elif word == "end":
                return


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
