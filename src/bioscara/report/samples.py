"""The samples of motions as numpy arrays, or as a pandas frame."""

from __future__ import annotations

from array import array
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from bioscara.errors import InvalidArgumentError
from bioscara.extras import install, pip_install, require
from bioscara.kinematics import Joints
from bioscara.notebook import table
from bioscara.report import png
from bioscara.report.cycles import CycleRecord, JointRecord, Phase, SampleQuality
from bioscara.report.sample_file import header

if TYPE_CHECKING:
    import pandas

    from bioscara.report.picture import Picture

Array = npt.NDArray[np.float64]

_NAMES = header(Joints._fields).split(",")
_COLUMN = {name: index for index, name in enumerate(_NAMES)}
_UNITS = ("rad", "m", "rad", "rad")
_PHASES = tuple(Phase)
_PHASE_NUMBER = {phase: number for number, phase in enumerate(_PHASES)}
_QUALITIES = [quality.name.lower() for quality in SampleQuality]


class Samples:
    """Records the cycles of motions, as their argument ``on_cycle``.

    For example:

        samples = Samples()
        robot.move_linear(pose, on_cycle=samples)
        error = samples.positions - samples.references

    One recording may take several motions, one after the other. Each array is a copy of the samples
    recorded by then, and may be read in any thread while the motion runs. An hour at 100 Hz takes
    about 120 MB.
    """

    def __init__(self) -> None:
        # One immutable row per cycle: appending one is atomic, so that a thread that reads the
        # arrays never delays or disturbs the control loop.
        self._rows: list[bytes] = []

    def __call__(self, cycle: CycleRecord) -> None:
        """Record a cycle."""
        row = array(
            "d",
            (
                cycle.start,
                _PHASE_NUMBER[cycle.phase],
                cycle.trajectory_time,
                cycle.bus_time,
                cycle.retries,
                cycle.late,
            ),
        )
        for joint in cycle.joints:
            row.extend(joint)
        self._rows.append(row.tobytes())

    def __len__(self) -> int:
        return len(self._rows)

    def __repr__(self) -> str:
        if not self._rows:
            return "<Samples, empty>"
        times = self.times
        return f"<Samples, {len(times)} cycles in {times[-1] - times[0]:.2f} s>"

    def _repr_html_(self) -> str:
        rows = [("cycles", str(len(self)), "")]
        if self._rows:
            rows.append(("duration", f"{np.ptp(self.times):.2f}", "s"))
            with np.errstate(invalid="ignore"):
                errors = np.abs(self.positions - self.references)
                speeds = np.abs(self.velocities)
            for number, (name, unit) in enumerate(zip(Joints._fields, _UNITS, strict=True)):
                error, speed = _largest(1e3 * errors[:, number]), _largest(speeds[:, number])
                rows.append((f"{name}: largest error", error, f"m{unit}"))
                rows.append((f"{name}: highest speed", speed, f"{unit}/s"))
        return table(rows)

    def plot(self) -> Picture:
        """Draw position, velocity and tracking error of every joint.

        A notebook shows the figure; elsewhere ``samples.plot().savefig("motion.png")`` writes it.

        Raises:
            NotSupportedError: matplotlib is not installed.
            InvalidArgumentError: Nothing is recorded yet.
        """
        require("matplotlib", "plot()", install("plot"))
        if not self._rows:
            raise InvalidArgumentError(
                "there are no samples to plot; give them to a motion: on_cycle=samples"
            )
        fields = ("time", "position", "reference", "velocity", "reference_velocity")
        columns = [self._of_joints(field) for field in fields]
        joints = [
            png.Curves(name, unit, *(column[:, number] for column in columns))
            for number, (name, unit) in enumerate(zip(Joints._fields, _UNITS, strict=True))
        ]
        return png.draw(str(self)[1:-1], "time since the robot was connected [s]", joints)

    @property
    def times(self) -> Array:
        """Begin of each cycle [s since the robot was connected], shape (n,)."""
        return self._table()[:, 0]

    @property
    def phases(self) -> tuple[Phase, ...]:
        """Part of the motion that each cycle belongs to."""
        return tuple(_PHASES[int(number)] for number in self._table()[:, _COLUMN["phase"]])

    @property
    def positions(self) -> Array:
        """Measured joint positions [rad, m, rad, rad], shape (n, 4); NaN if unknown."""
        return self._of_joints("position")

    @property
    def velocities(self) -> Array:
        """Measured joint velocities [rad/s, m/s, rad/s, rad/s], shape (n, 4)."""
        return self._of_joints("velocity")

    @property
    def references(self) -> Array:
        """Reference positions at the measurements, shape (n, 4); NaN where there is none.

        ``positions - references`` is the tracking error.
        """
        return self._of_joints("reference")

    def to_pandas(self) -> pandas.DataFrame:
        """Return a frame with one row per cycle and the columns of ``samples.csv``.

        Raises:
            NotSupportedError: pandas is not installed.
        """
        require("pandas", "to_pandas()", pip_install("pandas"))
        import pandas  # noqa: PLC0415  takes a second, and is optional

        frame = pandas.DataFrame(self._table(), columns=_NAMES)
        frame["phase"] = [_PHASES[int(number)].value for number in frame["phase"]]
        frame["retries"] = frame["retries"].astype(int)
        for name in Joints._fields:
            frame[f"{name}_flags"] = frame[f"{name}_flags"].astype(int)
            quality = frame[f"{name}_quality"].astype(int)
            frame[f"{name}_quality"] = [_QUALITIES[number] for number in quality]
        return frame

    def _table(self) -> Array:
        flat = np.frombuffer(b"".join(self._rows), dtype=np.float64)
        return flat.reshape(-1, len(_NAMES)).copy()

    def _of_joints(self, field: str) -> Array:
        table = self._table()
        first = _COLUMN[f"{Joints._fields[0]}_{field}"]
        return table[:, first :: len(JointRecord._fields)]


def _largest(values: Array) -> str:
    known = values[~np.isnan(values)]
    return f"{known.max():.3f}" if known.size else "unknown"
