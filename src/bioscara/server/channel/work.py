"""Computations of the workers for clients: answers as bytes in the form of the client.

Nothing here belongs to a running arm: plans begin at a workspace that is given, and files are read
from their folders.
"""

from __future__ import annotations

import mmap
import os
import pickle
from collections.abc import Callable, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

from bioscara.api import framing, messages as m
from bioscara.api.values import Columns, columns_value, joined_parts, trajectory_part
from bioscara.physics.camera import png
from bioscara.physics.stills import Still, image_of
from bioscara.planning import Trajectory
from bioscara.robot.planner import Planner, planned_here
from bioscara.robot.tasks.motions import Motion
from bioscara.robot.workspace.workspace import Workspace
from bioscara.server.channel.channel_messages import SHOWN, WorldStill
from bioscara.server.state.history import StateHistory
from bioscara.server.state.queries import flight_record, flight_records

T = TypeVar("T")


def encoded(result: m.AnyResult, json: bool) -> bytes:
    """Return a result in the form of a client."""
    return framing.encode_json(result) if json else framing.encode_packed(result)


def warm_up(planner: Planner) -> None:
    """Plan a small motion, so that modules are imported and tables computed."""
    here = planner.here()
    motion = Trajectory(planner.joint_names, [0.0, 1.0], [here, here._replace(j1=here.j1 + 0.01)])
    planner.check_trajectory(motion, here)


@lru_cache(maxsize=4)
def _workspace(data: bytes) -> Workspace:
    workspace: Workspace = pickle.loads(data)  # noqa: S301  of our process
    return workspace


def plan(
    data: bytes, positions: Sequence[float], motion: Motion, number: int, json: bool
) -> tuple[bytes, bytes]:
    """Plan a motion; return the answer, and the trajectory as :func:`pickle.dumps` makes it.

    Args:
        data: The workspace, as :func:`pickle.dumps` made it.
        positions: Where the joints are [rad, m, rad, rad].
        motion: The motion.
        number: Number of the plan.
        json: Whether the client has JSON.

    Raises:
        BioscaraError: It cannot be planned.
    """
    made = planned(motion.plan, data, positions)
    points = len(made.trajectory.times)
    # Evenly, with the last one: the arm follows all of them.
    step = -(-points // SHOWN)
    shown = trajectory_part(made.trajectory, slice(None, None, step))
    if (points - 1) % step:
        shown = joined_parts(shown, trajectory_part(made.trajectory, slice(points - 1, None)))
    answer = m.PlanMade(number, shown, made.notes, points)
    return encoded(answer, json), pickle.dumps(made.trajectory)


def trajectories(goal: int, points: int, paths: bytes, json: bool) -> bytes:
    """Return the answer with a part of the trajectories of a goal.

    Args:
        goal: Number of the goal.
        points: Number of points of the longest trajectory.
        paths: The part of each, as :func:`pickle.dumps` made them.
        json: Whether the client has JSON.
    """
    parts: list[Columns] = pickle.loads(paths)  # noqa: S301  of our process
    values = tuple(map(columns_value, parts))
    return encoded(m.GoalTrajectories(goal, values, points), json)


@lru_cache(maxsize=1)
def _history(process: int, file: int, names: tuple[str, ...], rate: int) -> StateHistory:
    memory = os.open(f"/proc/{process}/fd/{file}", os.O_RDWR | os.O_CLOEXEC)
    try:
        return StateHistory(names, rate, mmap.mmap(memory, 0))
    finally:
        os.close(memory)


def history(
    memory: tuple[int, int, tuple[str, ...], int], command: m.GetHistory, json: bool
) -> bytes:
    """Return the answer with the history of a time.

    Args:
        memory: Process and file of the memory of the history, the joints and the rate [Hz].
        command: The question.
        json: Whether the client has JSON.
    """
    kept = _history(*memory)
    return encoded(kept.between(command.begin, command.end, command.points), json)


@lru_cache(maxsize=1)
def _model(data: bytes) -> Any:
    return pickle.loads(data)  # noqa: S301  of our process


def image(command: m.GetImage, still: WorldStill, json: bool) -> bytes:
    """Return the answer with an image.

    Args:
        command: The question.
        still: What is drawn.
        json: Whether the client has JSON.

    Raises:
        NotSupportedError: Nothing can be drawn here.
    """
    positions, rotations = pickle.loads(still.state)  # noqa: S301  of our process
    world = Still(_model(still.model), positions, rotations)
    drawn = image_of(world, command.camera, (command.width, command.height))
    return encoded(m.ImageFile(time=still.time, camera=command.camera, data=png(drawn)), json)


def flight_record_list(folder: str, json: bool) -> bytes:
    """Return the answer with the names of the flight records in a folder."""
    return encoded(m.FlightRecordList(tuple(flight_records(Path(folder)))), json)


def flight_record_part(folder: str, command: m.GetFlightRecord, json: bool) -> bytes:
    """Return the answer with a flight record of a folder.

    Raises:
        InvalidArgumentError: There is none of that name, or it is too long.
        OSError: It cannot be read.
    """
    return encoded(flight_record(Path(folder), command.name), json)


def planned(make: Callable[[Planner], T], data: bytes, positions: Sequence[float]) -> T:
    """Return the plan of a function.

    Args:
        make: The function, picklable.
        data: The workspace, as :func:`pickle.dumps` made it.
        positions: Where the joints are [rad, m, rad, rad].

    Raises:
        BioscaraError: It cannot be planned.
    """
    return planned_here(make, _workspace(data), positions)
