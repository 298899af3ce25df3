"""``bioscara status``."""

from __future__ import annotations

import math

from bioscara.cli.output.console import Output
from bioscara.cli.parser import Options, Parser
from bioscara.cli.shared_arguments import share_served

_WARNINGS = 3
"""Number of warnings that are shown."""


def arguments(parser: Parser) -> None:
    share_served(parser)


def run(options: Options, output: Output) -> None:
    """Describe an arm, its activity and the client that commands it."""
    from bioscara.api import messages as m
    from bioscara.api.values import warnings_of
    from bioscara.cli.owner_link import asked, linked, owner_of, state_words

    name = owner_of(options)
    with linked(name) as link:
        described = asked(link, m.GetDescription(), m.Description)
        state = asked(link, m.GetState(), m.StateSample)
        faults = asked(link, m.GetFaults(), m.FaultList)
        lease = asked(link, m.GetLease(), m.LeaseState).lease
        goals = asked(link, m.ListGoals(), m.GoalList).goals
        counted = asked(link, m.GetStatistics(), m.Statistics)
        unconfirmed = asked(link, m.GetWorkspace(), m.WorkspaceState).unconfirmed
    output.line(f"arm: {name}, {described.arm}, version {described.software}")
    output.line(f"state: {state_words(state)}")
    if state.pose is not None:
        x, y, z, yaw = state.pose
        output.line(f"tool: {x:+z.4f} {y:+z.4f} {z:+z.4f} m, yaw {yaw:+z.4f} rad")
    for goal in goals:
        if not goal.done:
            share = "" if math.isnan(goal.progress) else f", {goal.progress:.0%}"
            output.line(
                f"goal {goal.goal}: {goal.name} by {goal.client}, {goal.status.value}{share}"
            )
    holder = f"{lease.client}, for {lease.remaining:.1f} s more" if lease.client else "nobody"
    output.line(f"commanded by: {holder}")
    for fault in faults.faults:
        output.line(f"fault: {fault.text}")
    if unconfirmed:
        output.line(
            f"warning: not confirmed since the owner was started: {' and '.join(unconfirmed)}; the "
            f"arm only jogs until 'bioscara confirm --arm {name}'"
        )
    for warning in warnings_of(faults)[-_WARNINGS:]:
        output.line(f"warning {state.time - warning.time:.0f} s ago: {warning}")
    if (earlier := len(faults.warnings) - _WARNINGS) > 0:
        output.line(f"{earlier} earlier warnings: bioscara events --arm {name}")
    p50, p99, most = (1e3 * value for value in counted.late)
    output.line(
        f"loop: {described.rate} Hz, {counted.rate} cycles in the last second; of {counted.cycles} "
        f"{counted.overruns} missed; late by {p50:.2f} ms (median), {p99:.2f} ms (p99), at most "
        f"{most:.2f} ms"
    )
    output.line(
        f"owner: {counted.clients} clients, {counted.memory / 2**20:.0f} MiB, for "
        f"{counted.uptime:.0f} s"
    )
