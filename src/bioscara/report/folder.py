"""The folder of one run."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from contextlib import suppress
from datetime import datetime
from pathlib import Path

from bioscara.errors import ConfigurationError
from bioscara.files.whole_files import replacing
from bioscara.report.cycles import CycleHistory
from bioscara.report.sample_file import ROW_BYTES, SampleWriter
from bioscara.report.summary import RunSummary

SAMPLES, REPORT, PLOT, PICTURE, TRAJECTORY = (
    "samples.csv",
    "report.txt",
    "plot.html",
    "plot.png",
    "trajectory.csv",
)
_ROOM_FOR_PLOTS = 4_000_000
"""Disk space reserved for page and picture [bytes]; with all points they take about 2 MB."""


class RunFolder:
    """A new folder with its samples file open.

    Attributes:
        path: The folder.
        samples: Writer that receives each cycle during the run.

    Args:
        path: The folder.
        samples: Writer of its samples file.
        made: The folders that were created for it, innermost first.
    """

    def __init__(self, path: Path, samples: SampleWriter, made: tuple[Path, ...] = ()) -> None:
        self.path = path
        self.samples = samples
        self._made = made

    @classmethod
    def create(cls, path: Path, joint_names: tuple[str, ...], cycles: int) -> RunFolder:
        """Create the folder, and check before anything moves that it can be written.

        Args:
            path: Path of the folder; parents are created. A folder that already has a run is not
                changed.
            joint_names: Names of the joints, for the header of the samples.
            cycles: Expected number of cycles; the disk must have room for them.

        Raises:
            ConfigurationError: The folder cannot be created or written, has another run, or too
                little room.
        """
        made = tuple(each for each in (path, *path.parents) if not each.exists())
        try:
            path.mkdir(parents=True, exist_ok=True)
            if (path / SAMPLES).exists():
                raise ConfigurationError(
                    f"run folder {path} holds a run already; name another with --out"
                )
            room = os.statvfs(path)
            samples = SampleWriter(path / SAMPLES, joint_names)
        except OSError as error:
            _remove_empty(made)
            raise ConfigurationError(
                f"run folder {path} cannot be written: {error.strerror or error}; "
                f"name a writable one with --out"
            ) from error
        free, needed = room.f_bavail * room.f_frsize, cycles * ROW_BYTES + _ROOM_FOR_PLOTS
        if free < needed:
            cls(path, samples, made).discard()
            raise ConfigurationError(
                f"run folder {path} has {free / 1e6:.1f} MB left and the run needs "
                f"{needed / 1e6:.1f} MB; free some or name another with --out"
            )
        return cls(path, samples, made)

    def finish(self, summary: RunSummary, history: CycleHistory) -> tuple[list[Path], list[str]]:
        """Close the samples and write report and plots.

        If one of them cannot be written, the others are still written.

        Returns:
            The complete files, and a sentence for each incomplete one.
        """
        # Imported here: they need numpy, which a refused run does not.
        from bioscara.report import html, png, text  # noqa: PLC0415

        self.samples.close()
        written = [
            self.path / name for name in (SAMPLES, TRAJECTORY) if (self.path / name).exists()
        ]
        problems = []
        writers: dict[str, Callable[[Path], None]] = {
            REPORT: lambda path: _write_text(path, text.render(summary, history)),
            PLOT: lambda path: _write_text(path, html.render(summary, history)),
            PICTURE: lambda path: png.write(path, summary, history),
        }
        for name, write in writers.items():
            if name == PICTURE and not png.available():
                continue
            try:
                write(self.path / name)
                written.append(self.path / name)
            except OSError as error:
                problems.append(f"{self.path / name} was not written: {error.strerror or error}")
        return written, problems

    def discard(self) -> None:
        """Remove the samples of a run that did not begin, and folders created for it."""
        self.samples.close()
        (self.path / SAMPLES).unlink(missing_ok=True)
        _remove_empty(self._made)


def _write_text(path: Path, content: str) -> None:
    with replacing(path) as partial:
        partial.write_text(content, encoding="utf-8")


def _remove_empty(folders: tuple[Path, ...]) -> None:
    # A folder with other files stays, and so does one that cannot be removed.
    with suppress(OSError):
        for folder in folders:
            folder.rmdir()


def default_path(base: Path, name: str, now: datetime) -> Path:
    """Return ``base/<time>-<name>``, with a number appended if that exists."""
    safe = re.sub(r"[^A-Za-z0-9._-]+", "-", name).strip("-.") or "run"
    wanted = base / f"{now:%Y%m%d-%H%M%S}-{safe}"
    path, number = wanted, 1
    while path.exists():
        number += 1
        path = wanted.with_name(f"{wanted.name}-{number}")
    return path
