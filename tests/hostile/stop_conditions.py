"""STOP by each door while an arm plans, waits, homes or is paused, measured at the plant."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack

import yaml

from bioscara import Pose
from bioscara.api import messages as m
from bioscara.planning.motions.waypoints import Waypoint
from bioscara.robot import tasks
from hostile.stop_doors import Door, Rig, Terminal, Watch
from programs import LIMIT, wait_until
from served import NAME, RawClient
from system.observed_arm import at_rest, truth

_CORNERS = 400
"""Waypoints of a path that is planned for longer than a STOP takes."""
_FAR = (0.5, 0.25, 1.0, 0.5)
_PLACES = [
    (0.35 + 0.02 * (row % 2), -0.1 + 0.2 * row / _CORNERS, 0.25, 0.0) for row in range(_CORNERS)
]
TASKS: dict[str, m.AnyTask] = {
    "planning": tasks.MoveSequence(waypoints=tuple(Waypoint(Pose(*each)) for each in _PLACES)),
    "wait": tasks.Wait(seconds=30.0),
    "homing": tasks.Home(),
    "pause": tasks.MoveJoints(positions=_FAR, velocity_scaling=0.1),
}
"""Tasks of the arm, by the name of the condition."""
_WAIT = [
    {"kind": "wait", "seconds": 30.0},
    {"kind": "move_joints", "positions": dict(zip(("j1", "j2", "j3", "j4"), _FAR, strict=True))},
]
_PATH = [
    {
        "kind": "move_sequence",
        "waypoints": [{"pose": dict(zip(Pose._fields, each, strict=True))} for each in _PLACES],
    }
]
_STILL = 1.0
"""Time for which the arm has to rest after a STOP [s]."""
_INTERRUPTED = 130


def _command(rig: Rig, condition: str) -> tuple[str, ...]:
    """Return the command that does the same in a terminal."""
    if condition == "homing":
        return "home", "--arm", NAME
    if condition == "pause":
        return "move", "--arm", NAME, "--joints", *map(str, _FAR)
    steps = _WAIT if condition == "wait" else _PATH
    path = rig.folder / f"{condition}.yaml"
    path.write_text(yaml.safe_dump({"schema": 1, "steps": steps}, explicit_end=True))
    return "run", str(path), "--arm", NAME


def _has_begun(rig: Rig, condition: str) -> bool:
    """Return whether a task other than a plan has begun."""
    running = rig.goal().status == "running"
    return running and (condition == "wait" or not at_rest(rig.plant))


def measure(rig: Rig, door: Door, condition: str) -> float:
    """Return the time from STOP to the end of the task; nothing moves afterwards [s].

    While it homes, the time to the deceleration.
    """
    rig.ready()
    before = rig.goal().goal
    with ExitStack() as stack, RawClient("mover") as client:
        if door.moves:
            terminal = Terminal(_command(rig, condition), stack)
            send: Callable[[], object] = terminal.interrupt
            if condition == "planning":
                terminal.wait_for("step 1")
        else:
            send = door.prepare(rig, stack)
            start = m.Start(task=TASKS[condition], on_lease_loss="finish")
            asked = client.begin(start, client.acquire())
        if condition == "planning":
            time.sleep(0.2)
            assert rig.goal().goal == before, "it is planned already"
        else:
            wait_until(lambda: _has_begun(rig, condition), f"the begin of {condition}")
        if condition == "pause":
            if door.moves:
                terminal.press("p")
            else:
                client.request(m.Pause())
            wait_until(lambda: bool(client.request(m.GetState()).paused), "it is paused")
            wait_until(lambda: at_rest(rig.plant), "the arm is at rest")
        with Watch(rig.plant) as watch:
            begin = time.monotonic()
            send()
            if door.moves:
                assert terminal.program.wait(LIMIT) == _INTERRUPTED
            elif condition == "planning":
                # A refusal, or a goal that was accepted at the moment of the stop.
                client.answer(asked)
            if not door.moves and rig.goal().goal > before:
                wait_until(lambda: rig.goal().status == "cancelled", "the task has ended")
            took = time.monotonic() - begin
            wait_until(lambda: at_rest(rig.plant), "the arm is at rest")
        place = truth(rig.plant)[0]
        if condition == "pause":
            client.request(m.Resume(), client.acquire(force=True))
        time.sleep(_STILL)
        assert max(abs(a - b) for a, b in zip(truth(rig.plant)[0], place, strict=True)) < 2e-3
    return watch.deceleration(begin) if condition == "homing" else took
