"""Flight records as the tests read them: with the reader of recordings."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from bioscara.planning.arrays import Array
from bioscara.recording.reading.sample_table import sample_tables
from bioscara.recording.reading.scan import FileScan
from bioscara.robot.connection.evidence_folder import METADATA


class ReadRecord(NamedTuple):
    """A flight record.

    Attributes:
        faults: The faults in its head.
        table: Its cycles, as columns by name.
    """

    faults: list[str]
    table: Mapping[str, Array]

    @property
    def times(self) -> list[float]:
        """Times of the cycles on the arm's clock [s]."""
        times: list[float] = self.table["arm_time"].tolist()
        return times


def read_record(path: Path | None) -> ReadRecord:
    """Read a flight record, which must be complete."""
    assert path is not None
    scan = FileScan()
    tables = list(sample_tables(path, scan))
    assert scan.complete
    assert scan.damage == []
    columns = {name: np.concatenate([table[name] for table in tables]) for name in tables[0]}
    faults = [text for name, text in scan.metadata[METADATA].items() if name.startswith("fault ")]
    return ReadRecord(faults, columns)
