"""Rated diagnostics of a manager, as ros2_control publishes them on ``/diagnostics``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import IntEnum
from typing import NamedTuple

from bioscara.control.manager.manager import ControllerManager
from bioscara.control.manager.statistics import SpreadSummary
from bioscara.hardware import LifecycleState


class Level(IntEnum):
    """Severity; the numbers are those of ROS."""

    OK = 0
    WARN = 1
    ERROR = 2


class Threshold(NamedTuple):
    """Limits above which a value is rated WARN or ERROR.

    Attributes:
        warn: Above this it is :attr:`Level.WARN`.
        error: Above this it is :attr:`Level.ERROR`.
    """

    warn: float
    error: float

    def rate(self, value: float) -> Level:
        """Return the severity of a value; an unknown one is OK."""
        if value > self.error:
            return Level.ERROR
        return Level.WARN if value > self.warn else Level.OK


class Thresholds(NamedTuple):
    """Thresholds of a statistic; the numbers are the defaults of ros2_control.

    Attributes:
        mean_error: Deviation of the average from the expected value.
        standard_deviation: Standard deviation.
    """

    mean_error: Threshold
    standard_deviation: Threshold

    def rate(self, summary: SpreadSummary, expected: float) -> Level:
        """Return the severity of a statistic with an expected average."""
        return max(
            self.mean_error.rate(abs(summary.average - expected)),
            self.standard_deviation.rate(summary.standard_deviation),
        )


PERIODICITY = Thresholds(Threshold(5.0, 10.0), Threshold(5.0, 10.0))
"""Of controllers and the manager [Hz]."""
EXECUTION_TIME = Thresholds(Threshold(1000e-6, 2000e-6), Threshold(100e-6, 200e-6))
"""Of controllers, and of reading and writing hardware [s]; the expected value is 0."""


class DiagnosticStatus(NamedTuple):
    """One entry of the diagnostics.

    Attributes:
        name: Its subject.
        level: Its severity.
        message: Why, in words.
        values: The details, by name.
    """

    name: str
    level: Level
    message: str
    values: Mapping[str, str]


def diagnose(
    manager: ControllerManager, faults: Sequence[object] = ()
) -> tuple[DiagnosticStatus, DiagnosticStatus, DiagnosticStatus]:
    """Return the status of the controllers, the hardware and the manager.

    Args:
        manager: The manager.
        faults: Faults of the arm that stop it; each is an error of the hardware.
    """
    return _controllers(manager), _hardware(manager, faults), _cycles(manager)


def _controllers(manager: ControllerManager) -> DiagnosticStatus:
    values: dict[str, str] = {}
    ratings: list[tuple[Level, str]] = []
    for controller in manager.controllers:
        name, statistics = controller.name, controller.statistics
        values[f"{name}.state"] = controller.state.label
        execution_time = statistics.execution_time.summary()
        periodicity = statistics.periodicity.summary()
        if controller.state is not LifecycleState.ACTIVE or not periodicity.sample_count:
            continue
        values[f"{name}.execution_time"] = _microseconds(execution_time)
        values[f"{name}.periodicity"] = _hertz(periodicity)
        rate = 1.0 / controller.nominal_period
        ratings += [
            (EXECUTION_TIME.rate(execution_time, 0.0), f"{name}.execution_time"),
            (PERIODICITY.rate(periodicity, rate), f"{name}.periodicity"),
        ]
    if not manager.controllers:
        return DiagnosticStatus(
            "Controllers Activity", Level.WARN, "no controllers are loaded", values
        )
    return _status("Controllers Activity", ratings, values)


def _hardware(manager: ControllerManager, faults: Sequence[object]) -> DiagnosticStatus:
    values: dict[str, str] = {}
    ratings: list[tuple[Level, str]] = []
    statistics = manager.statistics
    for component in manager.components:
        name, active = component.name, component.state is LifecycleState.ACTIVE
        values[f"{name}.state"] = component.state.label
        if not active:
            ratings.append((Level.WARN, f"{name} is {component.state.label}"))
        for cycle, spreads in (("read", statistics.read), ("write", statistics.write)):
            summary = spreads[name].summary()
            if active and summary.sample_count:
                label = f"{name}.{cycle}_cycle.execution_time"
                values[label] = _microseconds(summary)
                ratings.append((EXECUTION_TIME.rate(summary, 0.0), label))
    if not any(component.state is LifecycleState.ACTIVE for component in manager.components):
        ratings = [(Level.ERROR, "no hardware component is active")]
    ratings = [*((Level.ERROR, str(fault)) for fault in faults), *ratings]
    return _status("Hardware Components Activity", ratings, values)


def _cycles(manager: ControllerManager) -> DiagnosticStatus:
    summary = manager.statistics.periodicity.summary()
    values = {"update_rate": str(manager.rate)}
    for key in ("average", "standard_deviation", "min", "max"):
        values[f"periodicity.{key}"] = f"{getattr(summary, key):.3f}"
    ratings = [(PERIODICITY.rate(summary, manager.rate), "periodicity")]
    return _status("Controller Manager Activity", ratings, values)


def _status(
    name: str, ratings: list[tuple[Level, str]], values: Mapping[str, str]
) -> DiagnosticStatus:
    """Return the worst severity, with all entries that are not OK."""
    bad = [(level, subject) for level, subject in ratings if level is not Level.OK]
    level = max((level for level, _ in bad), default=Level.OK)
    return DiagnosticStatus(
        name, level, "; ".join(subject for _, subject in bad) or "all is well", values
    )


def _microseconds(summary: SpreadSummary) -> str:
    average, low, high, deviation = (1e6 * each for each in summary[:4])
    return f"Avg: {average:.2f} [{low:.2f} - {high:.2f}] us, StdDev: {deviation:.2f}"


def _hertz(summary: SpreadSummary) -> str:
    average, low, high, deviation = summary[:4]
    return f"Avg: {average:.2f} [{low:.2f} - {high:.2f}] Hz, StdDev: {deviation:.2f}"
