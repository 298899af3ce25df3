"""The samples of motions as numpy arrays, or as a pandas frame."""

from __future__ import annotations

from array import array
from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from bioscara.errors import NotSupportedError
from bioscara.extras import pip_install
from bioscara.kinematics import Joints
from bioscara.report.cycles import CycleRecord, JointRecord, Phase, SampleQuality
from bioscara.report.sample_file import header

if TYPE_CHECKING:
    import pandas

Array = npt.NDArray[np.float64]

_NAMES = header(Joints._fields).split(",")
_COLUMN = {name: index for index, name in enumerate(_NAMES)}
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
        if find_spec("pandas") is None:
            raise NotSupportedError(
                f"to_pandas() needs pandas, which is not installed: {pip_install('pandas')}"
            )
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
