"""``bioscara arms``, ``status``, ``lease``, ``events`` and ``logs``: running owners."""

from __future__ import annotations

import math
import os
import queue
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from typing import TypeVar

from bioscara.api import framing, runtime
from bioscara.api import messages as m
from bioscara.cli.arguments import ARM_VARIABLE
from bioscara.cli.options import Options
from bioscara.cli.output.console import ExitStatus, Output, columns, complain
from bioscara.cli.signals import StopRequest
from bioscara.errors import BioscaraError, InvalidArgumentError, OwnerError, OwnerLostError
from bioscara.remote.link import OwnerLink

R = TypeVar("R", bound=m.Result)

_WARNINGS = 3
"""Number of warnings that ``status`` shows."""
_POLL = 0.1
"""Period in which a wait looks for Ctrl-C [s]."""
_LOG_PERIOD = 0.5
"""Time between two questions for new lines of the log [s]."""


def run(options: Options) -> int:
    """List the running owners, or describe one.

    Raises:
        OwnerLostError: No owner runs.
        InvalidArgumentError: There are several, and none is named.
        OSError: Standard output cannot be written.
    """
    output = Output()
    commands = {"status": _status, "lease": _lease, "events": _events, "logs": _logs}
    if options.command == "arms":
        status = _arms(output)
    else:
        status = commands[options.command](owner_name(options), options, output)
    output.check()
    return status


def owner_name(options: Options) -> str:
    """Return the name of the owner that a command is about.

    Raises:
        OwnerLostError: No owner runs.
        InvalidArgumentError: There are several, and none is named.
    """
    if name := options.arm or os.environ.get(ARM_VARIABLE):
        return name
    running = [owner.name for owner in runtime.owners()]
    if not running:
        raise OwnerLostError("no arm is served; bioscara serve starts an owner")
    if len(running) > 1:
        raise InvalidArgumentError(
            f"there are the arms {', '.join(running)}; choose one with --arm NAME"
        )
    return running[0]


@contextmanager
def linked(name: str, client: str | None = None) -> Iterator[OwnerLink]:
    """Connect to an owner within a block of code.

    Args:
        name: Name of the owner.
        client: Name of this client; None for that of the program.
    """
    link = OwnerLink(name, lambda _: None, lambda _: None, client=client)
    with closing(link):
        link.open()
        yield link


def _arms(output: Output) -> ExitStatus:
    rows: list[tuple[str, ...]] = [("arm", "bus", "process", "state", "commanded by")]
    for owner in runtime.owners():
        try:
            with linked(owner.name) as link:
                state = asked(link, m.GetState(), m.StateSample)
                lease = asked(link, m.GetLease(), m.LeaseState).lease
                words = _words(state), lease.client or "nobody"
        except BioscaraError as error:
            words = f"does not answer: {error}", "-"
        rows.append((owner.name, owner.bus, str(owner.pid), *words))
    if len(rows) == 1:
        output.line("no arm is served; bioscara serve starts an owner")
        return ExitStatus.OK
    for line in columns(rows):
        output.line(line)
    return ExitStatus.OK


def _words(state: m.StateSample) -> str:
    """Return the state of an arm in words."""
    words = ["enabled" if state.enabled else "disabled"]
    if any(map(math.isnan, state.positions)):
        words.append("unknown" if state.stale else "not homed")
    if state.fault != "clear":
        words.insert(0, f"fault {state.fault}")
    if state.paused:
        # A recording of an older version does not have the names.
        authors = f" by {', '.join(state.paused_by)}" if state.paused_by else ""
        words.append(f"paused{authors}")
    return ", ".join([*words, *state.moving])


def _status(name: str, options: Options, output: Output) -> ExitStatus:  # noqa: ARG001
    with linked(name) as link:
        described = asked(link, m.GetDescription(), m.Description)
        state = asked(link, m.GetState(), m.StateSample)
        faults = asked(link, m.GetFaults(), m.FaultList)
        lease = asked(link, m.GetLease(), m.LeaseState).lease
        goals = asked(link, m.ListGoals(), m.GoalList).goals
        counted = asked(link, m.GetStatistics(), m.Statistics)
        unconfirmed = asked(link, m.GetWorkspace(), m.WorkspaceState).unconfirmed
    output.line(f"arm: {name}, {described.arm}, version {described.software}")
    output.line(f"state: {_words(state)}")
    if state.pose is not None:
        x, y, z, yaw = state.pose
        output.line(f"tool: {x:+z.4f} {y:+z.4f} {z:+z.4f} m, yaw {yaw:+z.4f} rad")
    for goal in goals:
        if not goal.done:
            share = "" if math.isnan(goal.progress) else f", {goal.progress:.0%}"
            output.line(f"goal {goal.goal}: {goal.name} by {goal.client}, {goal.status}{share}")
    holder = f"{lease.client}, for {lease.remaining:.1f} s more" if lease.client else "nobody"
    output.line(f"commanded by: {holder}")
    for fault in faults.faults:
        output.line(f"fault: {fault.text}")
    if unconfirmed:
        output.line(
            f"warning: not confirmed since the owner was started: {' and '.join(unconfirmed)}; the "
            f"arm only jogs until 'bioscara confirm --arm {name}'"
        )
    for warning in faults.warnings[-_WARNINGS:]:
        output.line(f"warning: {warning}")
    if (earlier := len(faults.warnings) - _WARNINGS) > 0:
        output.line(f"{earlier} earlier warnings: bioscara events --arm {name}")
    p50, p99, most = (1e3 * value for value in counted.late)
    output.line(
        f"loop: {described.rate} Hz, {counted.cycles} cycles, {counted.overruns} missed; late by "
        f"{p50:.2f} ms (median), {p99:.2f} ms (p99), at most {most:.2f} ms"
    )
    output.line(
        f"owner: {counted.clients} clients, {counted.memory / 2**20:.0f} MiB, for "
        f"{counted.uptime:.0f} s"
    )
    return ExitStatus.OK


def _lease(name: str, options: Options, output: Output) -> ExitStatus:
    with linked(name) as link:
        lease = asked(link, m.GetLease(), m.LeaseState).lease
        if lease.client is None:
            output.line(f"nobody commands {name}")
        elif options.end:
            taken = asked(link, m.AcquireLease(force=True), m.LeaseState).lease
            link.request(m.ReleaseLease(), taken.epoch)
            output.line(f"ended the lease of {lease.client}; nobody commands {name} now")
        else:
            output.line(f"{lease.client} commands {name}, for {lease.remaining:.1f} s more")
    return ExitStatus.OK


def _events(name: str, options: Options, output: Output) -> ExitStatus:
    arrived: queue.SimpleQueue[m.Event | OwnerLostError] = queue.SimpleQueue()

    def receive(message: m.FromOwner) -> None:
        if isinstance(message, m.Event):
            arrived.put(message)

    link = OwnerLink(name, receive, arrived.put, events_after=options.after)
    with StopRequest() as cancelled, closing(link):
        link.open()
        last = link.welcome.last_event
        shown = options.after
        while not cancelled() and (options.follow or shown < last) and output.problem is None:
            with suppress(queue.Empty):
                event = arrived.get(timeout=_POLL)
                if isinstance(event, OwnerLostError):
                    complain(str(event))
                    return ExitStatus.FAILED
                shown = event.number
                output.line(_event_line(event, options))
    return ExitStatus.OK


def _event_line(event: m.Event, options: Options) -> str:
    if options.json:
        return framing.encode_json(event).decode()
    clock = time.strftime("%H:%M:%S", time.localtime(event.wall))
    return f"{event.number:6d}  {clock}  {event.what:14s}  {event.text}"


def _logs(name: str, options: Options, output: Output) -> ExitStatus:
    with StopRequest() as cancelled, linked(name) as link:
        last, due = 0, 0.0
        while not cancelled() and output.problem is None:
            if (now := time.monotonic()) >= due:
                due = now + _LOG_PERIOD
                log = asked(link, m.GetLog(last), m.LogLines)
                last = log.last
                for line in log.lines:
                    output.line(line)
                if not options.follow:
                    break
            time.sleep(_POLL)
    return ExitStatus.OK


def asked(link: OwnerLink, command: m.AnyCommand, kind: type[R]) -> R:
    """Return the answer of an owner to a request."""
    result = link.request(command)
    if not isinstance(result, kind):
        raise OwnerError(f"the owner answered {type(result).__name__}, not {kind.__name__}")
    return result
