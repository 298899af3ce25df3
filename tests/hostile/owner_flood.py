"""Hostile clients of an owner's socket until they are killed: ``owner_flood.py ARM KIND COUNT``.

They say ``flooding`` once they have begun. The kinds are ``questions``, all that a client which
only looks may ask, with long paths to plan, as fast as they are read; ``pauses`` and ``hellos``,
which connect, pause or introduce themselves, and leave; and ``silent``, connections that say
nothing, of which each that is closed is made again.
"""

from __future__ import annotations

import itertools
import os
import random
import resource
import select
import socket
import sys
import threading
import time
from contextlib import suppress

from bioscara import Pose
from bioscara.api import framing, messages as m
from bioscara.api.runtime import find
from bioscara.planning.motions.waypoints import Waypoint
from bioscara.robot import tasks
from served import RawClient

BLOCK = 64
"""Questions that are sent at once."""


def raster(count: int) -> m.MakePlan:
    """Return the question for a path of many waypoints."""
    points = [
        Waypoint(Pose(0.35 + 0.02 * (row % 2), -0.1 + 0.2 * row / count, 0.15, 0.0))
        for row in range(count)
    ]
    return m.MakePlan(tasks.MoveSequence(waypoints=tuple(points)))


QUESTIONS: list[m.AnyCommand] = [
    *(m.GetState(), m.GetDescription(), m.GetWorkspace(), m.GetHistory(begin=0.0, points=5000)),
    *(m.GetSimulation(), m.GetFaults(), m.GetGoal(1), m.GetTrajectories(1), m.GetLease()),
    *(m.GetStatistics(), m.GetJoints(), m.GetParameters(), m.ListControllers()),
    *(m.ListFlightRecords(), m.GetFlightRecord("none"), m.ListGoals(), m.GetLog(0)),
    *(m.GetIntrospection(), m.QueryController("none", 0.0), raster(200)),
    *(m.MakePlan(tasks.MoveJoints(positions=(0.1, 0.2, 0.6, 0.3))), m.Recall(1)),
    *(m.Subscribe(states=True, controllers=True, events_after=0), m.Subscribe()),
]
"""A question of each kind, with large answers."""


def questions(path: str, count: int) -> None:
    """Ask without an end; one thread serves all connections, to leave the computer to the owner."""
    chance, numbers = random.Random(1), itertools.count(1)
    say(f"seed 1, {count} clients")
    clients = [RawClient(f"viewer {number}", path=find(path).socket) for number in range(count)]
    waiting = {client.socket.fileno(): (client.socket, b"") for client in clients}
    poll = select.poll()
    for file, (connection, _) in waiting.items():
        connection.setblocking(False)
        poll.register(file, select.POLLIN | select.POLLOUT)
    say("flooding")
    while True:
        for file, event in poll.poll():
            connection, left = waiting[file]
            with suppress(BlockingIOError):
                if event & select.POLLIN and not connection.recv(1 << 20):
                    poll.unregister(file)
                    continue
                if event & select.POLLOUT:
                    left = left or b"".join(
                        framing.packed(m.ClientRequest(id=number, command=command))
                        for number, command in zip(
                            itertools.islice(numbers, BLOCK),
                            chance.choices(QUESTIONS, k=BLOCK),
                            strict=True,
                        )
                    )
                    waiting[file] = connection, left[connection.send(left) :]


def visits(path: str, count: int, command: m.AnyCommand | None) -> None:
    """Connect, say hello, send a command if there is one, and leave, in some threads."""

    def visit(number: int) -> None:
        for turn in itertools.count():
            with suppress(OSError, EOFError), RawClient(f"{number} {turn}", path=socket_of) as one:
                if command is not None:
                    one.answer(one.begin(command))

    socket_of = find(path).socket
    for number in range(count):
        threading.Thread(target=visit, args=(number,), daemon=True).start()
    say("flooding")
    threading.Event().wait()


def silent(path: str, count: int) -> None:
    """Keep silent connections."""
    resource.setrlimit(resource.RLIMIT_NOFILE, (2 * count, 2 * count))
    address = os.fspath(find(path).socket)
    connections: list[socket.socket] = []
    said = False
    while True:
        for connection in [each for each in connections if _closed(each)]:
            connections.remove(connection)
            connection.close()
        while len(connections) < count:
            connection = socket.socket(socket.AF_UNIX)
            connection.settimeout(1.0)
            connections.append(connection)
            with suppress(OSError):
                connection.connect(address)
        if not said:
            said = True
            say("flooding")
        time.sleep(0.01)


def _closed(connection: socket.socket) -> bool:
    connection.setblocking(False)
    try:
        return not connection.recv(1 << 16)
    except BlockingIOError:
        return False
    except OSError:
        return True


def say(text: str) -> None:
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def main() -> None:
    arm, kind, count = sys.argv[1], sys.argv[2], int(sys.argv[3])
    match kind:
        case "questions":
            questions(arm, count)
        case "pauses":
            visits(arm, count, m.Pause())
        case "hellos":
            visits(arm, count, None)
        case "silent":
            silent(arm, count)


if __name__ == "__main__":
    main()
