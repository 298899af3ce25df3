"""``bioscara simulate-fault``: faults of a served arm that its owner simulates."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence

from bioscara.cli.output.console import Output
from bioscara.cli.parser import Options, Parser
from bioscara.cli.shared_arguments import share_served
from bioscara.errors import InvalidArgumentError
from bioscara.sim.bench import FAULTS, BenchFault


def arguments(parser: Parser) -> None:
    parser.add_argument("fault", metavar="FAULT", help="one of the faults below")
    parser.add_argument(
        "values",
        metavar="JOINT VALUE",
        nargs="*",
        help="its arguments: a joint, as j3, and a value",
    )
    share_served(parser)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.epilog = "\n".join(["faults:", *kinds(), "", parser.epilog or "", ""])


def run(options: Options, output: Output) -> None:
    """Let a simulated arm fail, or end that, and list the faults that last.

    Raises:
        NotSupportedError: The arm is real.
        InvalidArgumentError: There is no such fault or joint, or the value is not possible; or
            there are several arms, and none is named.
    """
    from bioscara.api import messages as m
    from bioscara.cli.owner_link import asked, linked, owner_of

    name = owner_of(options)
    joint, value = _words(options.fault, options.values)
    with linked(name) as link:
        link.request(m.SimulateFault(options.fault, joint, value))
        lasting = asked(link, m.GetSimulation(), m.SimulationState).faults
    for each in lasting:
        where = f"{each.joint} " if each.joint else ""
        output.line(f"{name} simulates: {where}{each.fault} {each.value:g}")
    if lasting:
        output.line(f"end all: bioscara simulate-fault clear --arm {name}")
    else:
        output.line(f"{name} simulates no fault that lasts")


def _words(fault: str, words: Sequence[str]) -> tuple[str, float | None]:
    """Return the joint and the value of a fault; empty and None where there are none.

    Raises:
        InvalidArgumentError: There are more words than it takes, or the last one is no number.
    """
    kind = FAULTS.get(fault)
    if kind is None:
        # Refused by the owner, with the nearest known one.
        return "", None
    joints, values = (words[:1], words[1:]) if kind.of_joint else ((), words)
    usage = f"bioscara simulate-fault {fault} {arguments_of(kind)}".strip()
    if len(values) > (1 if kind.value else 0):
        raise InvalidArgumentError(f"{fault} does not take {' '.join(words)!r}; give {usage}")
    try:
        return "".join(joints), float(values[0]) if values else None
    except ValueError:
        raise InvalidArgumentError(f"{values[0]!r} is not a number; give {usage}") from None


def arguments_of(kind: BenchFault) -> str:
    """Return the arguments of a fault, for a usage."""
    value = "" if not kind.value else "VALUE" if math.isnan(kind.on) else "[VALUE]"
    return " ".join(word for word in ("JOINT" if kind.of_joint else "", value) if word)


def kinds() -> list[str]:
    """Return the faults with their arguments and units, as lines for the help."""
    usages = [f"{fault} {arguments_of(kind)}" for fault, kind in FAULTS.items()]
    width = max(map(len, usages))
    return [
        f"  {usage:{width}}  {kind.meaning}{_value(kind)}"
        for usage, kind in zip(usages, FAULTS.values(), strict=True)
    ]


def _value(kind: BenchFault) -> str:
    """Return the meaning of the value, with its limits, as the end of a sentence."""
    if not kind.value:
        return ""
    unit = f" [{kind.unit}]" if kind.unit else ""
    switch = not math.isnan(kind.on)
    limits = "" if switch else f", {kind.lower:g} .. {kind.upper:g}{unit}"
    return f"; {kind.value}{limits}"
