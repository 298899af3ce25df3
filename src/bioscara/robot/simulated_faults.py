"""Faults of an arm that is simulated in this process; they are no commands of the arm."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from bioscara.errors import NotSupportedError
from bioscara.robot.arm import Arm
from bioscara.robot.runner import Runner

if TYPE_CHECKING:
    from bioscara.sim import Bench


def bench_of(arm: Arm) -> Bench:
    """Return the bench of an arm.

    Raises:
        NotSupportedError: It is not simulated in this process.
    """
    bench = getattr(arm.session.bus, "bench", None)
    # A real arm works without the compiled firmware.
    if bench is None or not isinstance(bench, import_module("bioscara.sim").Bench):
        raise NotSupportedError(
            "faults and speed can be chosen for an arm that 'bioscara serve --bus sim' or "
            "Robot.simulated() simulates; this one is real, or simulated by another process"
        )
    return bench  # type: ignore[no-any-return]


def simulate_fault(runner: Runner, fault: str, joint: str, value: float | None) -> str:
    """Let a simulated arm fail between two cycles, from any thread and also while it moves.

    Args:
        runner: Runs the operations of the arm.
        fault: The fault, as of :meth:`bioscara.sim.Bench.apply`; likewise the next ones.
        joint: The joint; empty for faults of the whole arm.
        value: The value; None for the one that begins it.

    Returns:
        A description of the change.

    Raises:
        NotSupportedError: The arm is not simulated in this process.
        InvalidArgumentError: There is no such fault or joint, or the value is not possible.
        LimitError: The value is outside its range.
    """
    bench = bench_of(runner.arm)
    return runner.aside("simulate_fault()", lambda: bench.apply(fault, joint, value))
