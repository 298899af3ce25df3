"""Rated diagnostics of a manager, as ros2_control publishes them on ``/diagnostics``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import IntEnum
from typing import NamedTuple

from bioscara.arguments import number
from bioscara.control.manager.manager import ControllerManager
from bioscara.control.manager.statistics import SpreadSummary
from bioscara.errors import InvalidArgumentError
from bioscara.hardware import LifecycleState
from bioscara.spelling import did_you_mean


class Level(IntEnum):
    """Severity; the numbers are those of ROS."""

    OK = 0
    WARN = 1
    ERROR = 2


class Thresholds:
    """Limits above which a statistic is rated WARN or ERROR.

    Their names are those of ros2_control behind ``diagnostics.threshold.``, such as
    ``controllers.execution_time.mean_error.warn``: of ``controllers``, ``hardware_components`` or
    the ``controller_manager``, the ``periodicity`` [Hz] or the ``execution_time`` [us]; its mean
    error or its standard deviation. The mean error of a periodicity is from the rate, that of a
    duration from 0.

    Args:
        rate: Cycles per second [Hz].
        given: Those that differ from :func:`default_thresholds`.
        pace: Simulated time in a second of real time; 1 for a real arm.

    Raises:
        InvalidArgumentError: There is none of a name, or a value is not above zero.
    """

    def __init__(self, rate: int, given: Mapping[str, float], pace: float = 1.0) -> None:
        self._values, self._pace = default_thresholds(rate), pace
        for name, value in given.items():
            if name not in self._values:
                hint = did_you_mean(name, self._values, "see docs/ros2.md")
                raise InvalidArgumentError(f"there is no threshold {name!r}; {hint}")
            if not number(name, value) > 0.0:
                raise InvalidArgumentError(f"threshold {name} {value:g} must be above zero")
            self._values[name] = value

    def rate_duration(self, whose: str, summary: SpreadSummary) -> Level:
        """Return the severity of a duration [s]; an unknown one is OK."""
        name = f"{whose}.execution_time"
        return self._rate(name, 1e6 * summary.average, 1e6 * summary.standard_deviation)

    def rate_periodicity(self, whose: str, summary: SpreadSummary, expected: float) -> Level:
        """Return the severity of a periodicity [Hz] that is expected; an unknown one is OK."""
        mean, deviation = summary.average / self._pace, summary.standard_deviation / self._pace
        return self._rate(f"{whose}.periodicity", abs(mean - expected), deviation)

    def _rate(self, name: str, mean_error: float, deviation: float) -> Level:
        statistics = ("mean_error", mean_error), ("standard_deviation", deviation)
        for word, level in (("error", Level.ERROR), ("warn", Level.WARN)):
            if any(value > self._values[f"{name}.{kind}.{word}"] for kind, value in statistics):
                return level
        return Level.OK


def default_thresholds(rate: int) -> dict[str, float]:
    """Return the default of each threshold, in Hz and us, for a rate of cycles [Hz].

    They are shares of the rate and of the cycle: reading and writing may fill the cycle of a slow
    bus, and the cycles of a computer that has other work come by some milliseconds too late.
    """
    cycle = 1e6 / rate
    limits = {
        "controller_manager.periodicity": ((0.05, 0.1), (0.25, 0.5), rate),
        "controllers.periodicity": ((0.05, 0.1), (0.25, 0.5), rate),
        "controllers.execution_time": ((0.1, 0.25), (0.1, 0.25), cycle),
        "hardware_components.execution_time": ((0.6, 0.9), (0.2, 0.4), cycle),
    }
    return {
        f"{name}.{kind}.{word}": share * whole
        for name, (mean, deviation, whole) in limits.items()
        for kind, shares in (("mean_error", mean), ("standard_deviation", deviation))
        for word, share in zip(("warn", "error"), shares, strict=True)
    }


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
    manager: ControllerManager,
    faults: Sequence[object] = (),
    thresholds: Thresholds | None = None,
) -> tuple[DiagnosticStatus, DiagnosticStatus, DiagnosticStatus]:
    """Return the status of the controllers, the hardware and the manager.

    Args:
        manager: The manager.
        faults: Faults of the arm that stop it; each is an error of the hardware.
        thresholds: By which statistics are rated; None for the defaults.
    """
    if thresholds is None:
        thresholds = Thresholds(manager.rate, {})
    return (
        _controllers(manager, thresholds),
        _hardware(manager, faults, thresholds),
        _cycles(manager, thresholds),
    )


def _controllers(manager: ControllerManager, thresholds: Thresholds) -> DiagnosticStatus:
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
            (thresholds.rate_duration("controllers", execution_time), f"{name}.execution_time"),
            (
                thresholds.rate_periodicity("controllers", periodicity, rate),
                f"{name}.periodicity",
            ),
        ]
    if not manager.controllers:
        return DiagnosticStatus(
            "Controllers Activity", Level.WARN, "no controllers are loaded", values
        )
    return _status("Controllers Activity", ratings, values)


def _hardware(
    manager: ControllerManager, faults: Sequence[object], thresholds: Thresholds
) -> DiagnosticStatus:
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
                ratings.append((thresholds.rate_duration("hardware_components", summary), label))
    if not any(component.state is LifecycleState.ACTIVE for component in manager.components):
        ratings = [(Level.ERROR, "no hardware component is active")]
    ratings = [*((Level.ERROR, str(fault)) for fault in faults), *ratings]
    return _status("Hardware Components Activity", ratings, values)


def _cycles(manager: ControllerManager, thresholds: Thresholds) -> DiagnosticStatus:
    summary = manager.statistics.periodicity.summary()
    values = {"update_rate": str(manager.rate)}
    for key in ("average", "standard_deviation", "min", "max"):
        values[f"periodicity.{key}"] = f"{getattr(summary, key):.3f}"
    level = thresholds.rate_periodicity("controller_manager", summary, manager.rate)
    ratings = [(level, "periodicity")]
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
