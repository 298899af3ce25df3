"""The folder of one run."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from datetime import datetime
from pathlib import Path

from bioscara.errors import ConfigurationError
from bioscara.report.cycles import History
from bioscara.report.samples import ROW_BYTES, SampleWriter
from bioscara.report.summary import Summary

SAMPLES, REPORT, PLOT, PICTURE, TRAJECTORY = (
    "samples.csv",
    "report.txt",
    "plot.html",
    "plot.png",
    "trajectory.csv",
)
_ROOM_FOR_PLOTS = 4_000_000
"""A page with all its points and a picture take about 2 MB."""


class RunFolder:
    """A new folder with its samples file open.

    Attributes:
        path: The folder.
        samples: Takes the cycles as they come.
    """

    def __init__(self, path: Path, samples: SampleWriter) -> None:
        self.path = path
        self.samples = samples

    @classmethod
    def create(cls, path: Path, joint_names: tuple[str, ...], cycles: int) -> RunFolder:
        """Make the folder, and make sure before anything moves that it can be written.

        Args:
            path: Where; parents are made. A folder that holds a run already is not touched.
            joint_names: For the header of the samples.
            cycles: How many cycles are expected; the disk must have room for them.

        Raises:
            ConfigurationError: The folder cannot be made or written, holds another run, or
                has too little room.
        """
        try:
            path.mkdir(parents=True, exist_ok=True)
            if (path / SAMPLES).exists():
                raise ConfigurationError(
                    f"run folder {path} holds a run already; name another with --out"
                )
            room = os.statvfs(path)
            samples = SampleWriter(path / SAMPLES, joint_names)
        except OSError as error:
            raise ConfigurationError(
                f"run folder {path} cannot be written: {error.strerror or error}; "
                f"name a writable one with --out"
            ) from error
        free, needed = room.f_bavail * room.f_frsize, cycles * ROW_BYTES + _ROOM_FOR_PLOTS
        if free < needed:
            samples.close()
            (path / SAMPLES).unlink()
            raise ConfigurationError(
                f"run folder {path} has {free / 1e6:.1f} MB left and the run needs "
                f"{needed / 1e6:.1f} MB; free some or name another with --out"
            )
        return cls(path, samples)

    def finish(self, summary: Summary, history: History) -> tuple[list[Path], list[str]]:
        """Close the samples and write report and plots.

        One that cannot be written does not keep the others from being written.

        Returns:
            The files that are complete, and a sentence for each that is not.
        """
        # Here and not above: they need numpy, which a refused run does not.
        from bioscara.report import html, png, text  # noqa: PLC0415

        self.samples.close()
        written = [
            self.path / name for name in (SAMPLES, TRAJECTORY) if (self.path / name).exists()
        ]
        problems = []
        for name, write in (
            (REPORT, lambda path: _write_text(path, text.render(summary, history))),
            (PLOT, lambda path: _write_text(path, html.render(summary, history))),
            (PICTURE, lambda path: png.write(path, summary, history)),
        ):
            if name == PICTURE and not png.available():
                continue
            try:
                self._write_whole(name, write)
                written.append(self.path / name)
            except OSError as error:
                problems.append(f"{self.path / name} was not written: {error.strerror or error}")
        return written, problems

    def _write_whole(self, name: str, write: Callable[[Path], None]) -> None:
        """Write one file, whole or not at all."""
        partial = self.path / f"partial-{name}"
        try:
            write(partial)
            partial.replace(self.path / name)
        except OSError:
            partial.unlink(missing_ok=True)
            raise


def _write_text(path: Path, content: str) -> None:
    path.write_text(content, encoding="utf-8")


def default_path(base: Path, name: str, now: datetime) -> Path:
    """Return ``base/<time>-<name>``, with a number appended while that exists."""
    safe = re.sub(r"[^A-Za-z0-9._-]+", "-", name).strip("-.") or "run"
    wanted = base / f"{now:%Y%m%d-%H%M%S}-{safe}"
    path, number = wanted, 1
    while path.exists():
        number += 1
        path = wanted.with_name(f"{wanted.name}-{number}")
    return path
