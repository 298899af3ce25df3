"""Reading files: planned trajectories, and files that no program wrote."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import yaml
from tests.system.odd_files import READERS, SHAPES, SIZE

from benchmarks.measure import Row, at_most, medians, timed
from bioscara.errors import BioscaraError, TrajectoryError
from bioscara.model import load_parameters
from bioscara.planning import check
from bioscara.planning.files.ros_message_parser import first_document
from bioscara.planning.files.ros_yaml import trajectory_of_message

POINTS, BRACKETS, ROUNDS = 1000, 16_000, 5
_READ, _CHECK, _DEEP, _ODD = 2, 0.25, 10, 300
"""Limits: of reading and checking, in the time of the C reader; of refusing nested brackets and a
file of any shape, in that of a loop over as many bytes."""
_POINT = """\
- positions: [0.1]
  velocities: [0.1]
  accelerations: [0.1]
  time_from_start: {{sec: {}, nanosec: 0}}
"""


def _bytes(number: int) -> Callable[[], None]:
    """Return a function that loops over bytes in plain Python."""
    data = bytes(number)

    def run() -> None:
        for _ in data:
            pass

    return run


def _refused(
    function: Callable[[], object], error: type[BioscaraError] = BioscaraError
) -> Callable[[], None]:
    """Return a function that calls another one, which raises ``error``."""

    def run() -> None:
        try:
            function()
        except error:
            return
        raise RuntimeError("nothing was refused")

    return run


def _trajectory() -> list[Row]:
    points = "".join(_POINT.format(index) for index in range(POINTS))
    text = f"joint_names: [j2]\npoints:\n{points}---\n"
    trajectory, _ = trajectory_of_message(text)
    limits = load_parameters().joints
    own, checked, peer = medians(
        lambda: trajectory_of_message(text),
        _refused(lambda: check(trajectory, limits), TrajectoryError),
        lambda: list(yaml.load_all(text, yaml.CSafeLoader)),
        rounds=ROUNDS,
    )
    whose = "PyYAML reads it in C"
    deep, loop = medians(
        _refused(lambda: first_document("[" * BRACKETS), TrajectoryError),
        _bytes(BRACKETS),
        number=10,
    )
    return [
        at_most(f"a message of {POINTS} points, read", own, _READ, peer, whose),
        at_most("the same, checked and refused", checked, _CHECK, peer, whose),
        at_most(f"{BRACKETS} open brackets, refused", deep, _DEEP, loop, "a loop over as many"),
    ]


def _odd() -> Row:
    """Measure the file of an unusual shape that takes longest."""
    with TemporaryDirectory() as folder:

        def reading(name: str, shape: str) -> Callable[[], None]:
            path = Path(folder) / f"{list(SHAPES).index(shape)}-{name}"
            path.write_bytes(SHAPES[shape])

            def run() -> None:
                try:
                    READERS[name](path)
                except BioscaraError:
                    return

            return run

        pairs = [(name, shape) for name in READERS for shape in SHAPES]
        name, shape = max(pairs, key=lambda pair: timed(reading(*pair)))
        own, loop = medians(reading(name, shape), _bytes(SIZE), rounds=ROUNDS)
    return at_most(
        f"{len(SHAPES)} files of up to 1 MiB of unusual shapes, read or refused: the slowest",
        own,
        _ODD,
        loop,
        "a loop over 1 MiB",
        f"{name}: {shape}",
    )


def rows() -> list[Row]:
    """Measure a long trajectory, deep nesting, and files of unusual shapes."""
    return [*_trajectory(), _odd()]
