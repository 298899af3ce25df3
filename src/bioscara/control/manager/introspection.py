"""All values and statistics of a manager, by their names in ROS's pal_statistics."""

from __future__ import annotations

from bioscara.control.manager.manager import ControllerManager
from bioscara.control.manager.statistics import Spread

_MICRO = 1e6


def introspect(manager: ControllerManager) -> dict[str, float]:
    """Return every interface and every statistic by name; computed only when called.

    Values of interfaces are in SI units, times in microseconds and periodicities in Hz, as there.
    Unknown values are NaN. Components have no periodicity: all have that of the manager.
    """
    claims, statistics = manager.claims, manager.statistics
    values = {f"state_interface.{name}": state.value for name, state in claims.states.items()}
    values |= {f"command_interface.{name}": each.value for name, each in claims.commands.items()}
    for controller in manager.controllers:
        own = f"{controller.name}.stats"
        values |= _spread(f"{own}/execution_time", controller.statistics.execution_time, _MICRO)
        values |= _spread(f"{own}/periodicity", controller.statistics.periodicity)
    for component in manager.components:
        for cycle, spreads in (("read", statistics.read), ("write", statistics.write)):
            name = f"{component.name}.stats/{cycle}_cycle/execution_time"
            values |= _spread(name, spreads[component.name], _MICRO)
    values |= _spread("controller_manager.periodicity", statistics.periodicity)
    times = (*statistics.timing, sum(statistics.timing), manager.switch_time)
    for name, taken in zip(("read", "update", "write", "total", "switch"), times, strict=True):
        values[f"controller_manager.{name}_time"] = _MICRO * taken
    return values


def _spread(name: str, spread: Spread, scale: float = 1.0) -> dict[str, float]:
    summary = spread.summary()._asdict()
    # The count is no quantity with a unit.
    return {
        f"{name}/{key}": value if key == "sample_count" else scale * value
        for key, value in summary.items()
    }
