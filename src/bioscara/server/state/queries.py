"""Answers to questions about an arm; nothing changes."""

from __future__ import annotations

import pickle
from pathlib import Path

from bioscara.api import messages as m
from bioscara.api.values import columns_of, fault_value
from bioscara.control.manager.listing import ComponentEntry, ControllerEntry, InterfaceEntry
from bioscara.control.manager.statistics import Histogram
from bioscara.errors import InvalidArgumentError
from bioscara.files.regular_file import McapFile, mcap_files
from bioscara.printing import encodable, printable
from bioscara.robot.arm import Arm
from bioscara.server.channel.channel_messages import SHOWN, GoalPaths, KnownFaults
from bioscara.server.controllers.loadable_controllers import CLIENT_TYPES
from bioscara.server.tasks.goals import ClientGoal
from bioscara.spelling import did_you_mean

_RECORD_MAX = 16 << 20
"""Longest flight record that is sent [byte]."""


def known_faults(arm: Arm) -> KnownFaults:
    """Return the faults and warnings of an arm."""
    supervisor = arm.stack.supervisor
    warnings = tuple(supervisor.warnings)
    faults = m.FaultList(
        supervisor.state,
        tuple(map(fault_value, tuple(supervisor.faults))),
        tuple(map(str, warnings)),
        tuple(warning.time for warning in warnings),
    )
    return KnownFaults(faults, tuple(warning.author for warning in warnings))


def goal_paths(goal: ClientGoal, first: int) -> GoalPaths:
    """Return a part of the trajectories that a goal follows.

    Args:
        goal: The goal.
        first: Index of the first point of each.

    Raises:
        InvalidArgumentError: They are not kept any more, or the index is below zero.
    """
    if first < 0:
        raise InvalidArgumentError(f"first {first} must not be below zero")
    paths = goal.paths
    points = max((len(path.times) for path in paths), default=0)
    part = slice(first, first + SHOWN)
    return GoalPaths(points, pickle.dumps([columns_of(path, part) for path in paths]))


def controller_list(arm: Arm) -> m.ControllerList:
    """Return the controllers and hardware components of an arm."""
    manager = arm.stack.manager
    return m.ControllerList(
        tuple(map(_controller, manager.list_controllers())),
        tuple(map(_component, manager.list_hardware_components())),
        CLIENT_TYPES,
    )


def _controller(entry: ControllerEntry) -> m.ControllerValue:
    return m.ControllerValue(
        entry.name,
        entry.kind,
        entry.state.label,
        entry.update_rate,
        entry.claimed_interfaces,
        entry.required_command_interfaces,
        entry.required_state_interfaces,
    )


def _component(entry: ComponentEntry) -> m.ComponentValue:
    return m.ComponentValue(
        entry.name,
        entry.kind,
        entry.plugin_name,
        entry.state.label,
        entry.rw_rate,
        tuple(map(_interface, entry.command_interfaces)),
        tuple(map(_interface, entry.state_interfaces)),
    )


def _interface(entry: InterfaceEntry) -> m.InterfaceValue:
    return m.InterfaceValue(entry.name, entry.is_available, entry.is_claimed)


def statistics(arm: Arm, uptime: float) -> m.Statistics:
    """Return the statistics of an arm's loop and of this process, which has no clients."""
    counted = arm.stack.loop.statistics
    return m.Statistics(
        cycles=counted.cycles,
        overruns=counted.overruns,
        rate=counted.rate,
        late=_percentiles(counted.late),
        read=_percentiles(counted.read),
        update=_percentiles(counted.update),
        write=_percentiles(counted.write),
        clients=0,
        memory=resident(),
        uptime=uptime,
    )


def _percentiles(histogram: Histogram) -> tuple[float, float, float]:
    return histogram.percentile(50.0), histogram.percentile(99.0), histogram.maximum


def resident() -> int:
    """Return the memory of this process that is not swapped out [byte]."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return 1024 * int(line.split()[1])
    return 0


def flight_records(folder: Path) -> dict[str, McapFile]:
    """Return the flight records in a folder by their names, oldest first; no link is one."""
    files = [path for path in mcap_files(folder) if path.is_one()]
    files.sort(key=lambda path: path.stat().st_mtime)
    return {encodable(path.name): path for path in files}


def flight_record(folder: Path, name: str) -> m.FlightRecordFile:
    """Return a flight record.

    Args:
        folder: The folder of the records.
        name: One of :func:`flight_records`; no path is made from it.

    Raises:
        InvalidArgumentError: There is none of that name, or it is too long.
        OSError: It cannot be read, or is no MCAP file.
    """
    known = flight_records(folder)
    if name not in known:
        hint = did_you_mean(name, known, "list_flight_records names them")
        raise InvalidArgumentError(f"there is no flight record {printable(name)!r}; {hint}")
    with known[name].open() as file:
        data = file.read(_RECORD_MAX + 1)
    if len(data) > _RECORD_MAX:
        raise InvalidArgumentError(f"{name} has more than {_RECORD_MAX} bytes")
    return m.FlightRecordFile(name, data)
