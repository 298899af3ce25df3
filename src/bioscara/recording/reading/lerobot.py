"""Recordings as LeRobot datasets, format 3.0: an episode for each goal that succeeded.

The layout is that of ``lerobot.datasets`` 0.6: https://huggingface.co/docs/lerobot. All episodes
are in one file, which takes 80 bytes a frame.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np
import numpy.typing as npt

from bioscara.errors import ConfigurationError, InvalidArgumentError, RecordingError
from bioscara.extras import install
from bioscara.files.whole_files import new_folder
from bioscara.planning.arrays import Array
from bioscara.recording.content import GRIPPER
from bioscara.recording.reading.json_messages import message_of
from bioscara.recording.reading.sample_table import sample_tables
from bioscara.recording.reading.scan import FileScan, messages
from bioscara.rosbag.topics import Topic

Column = npt.NDArray[Any]
"""Numbers of all frames, in the type of their file."""
_TIME = "arm_time"
_GAP = 0.1
"""Longest time without a complete sample within an episode, and at its ends [s]."""
_ENDS = {"observation.state": "_position", "action": "_command"}
"""By feature: ends of the names of its columns."""
_DATA = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
_CARD = """# {title}

A LeRobot dataset, format 3.0, made from a recording of a Bioscara arm by `bioscara record export`.
An episode is a goal of the arm, and its task is the name of the motion.

`observation.state` has the measured positions and `action` the commanded ones, of {names}:
j1, j3 and j4 in rad, j2 in m, the width of the jaws (gripper) in m. {fps} frames a second.
"""


class _Goal(msgspec.Struct, frozen=True):
    goal: int
    name: str
    status: str


class _Event(msgspec.Struct, frozen=True):
    what: str = ""
    time: float = float("nan")
    goal: _Goal | None = None


class _Span(NamedTuple):
    """A goal that succeeded, with its begin and end on the arm's clock [s]."""

    goal: _Goal
    begin: float
    end: float


class _Episode(NamedTuple):
    """Frames of a goal: its task, and by feature the numbers, shape (frames, joints)."""

    task: str
    frames: Mapping[str, Array]


class Dataset(NamedTuple):
    """A dataset that was written.

    Attributes:
        episodes: Number of its episodes.
        frames: Number of its frames.
        notes: Which goals and joints are left out, and why.
    """

    episodes: int
    frames: int
    notes: tuple[str, ...]


def export_lerobot(path: Path, out: Path, fps: int) -> Dataset:
    """Write the goals of a recording that succeeded as a LeRobot dataset.

    State and action are interpolated linearly. A goal is left out where a position was unknown, as
    in homing, or samples are missing. The jaws are left out where their width was never commanded.

    Args:
        path: The recording.
        out: The folder of the dataset; it must be empty, or not exist.
        fps: Frames per second, 1 up to the samples per second of the recording.

    Raises:
        ConfigurationError: pyarrow is not installed.
        InvalidArgumentError: The folder is not empty, or ``fps`` is outside its limits.
        RecordingError: The recording cannot be read, is damaged, or has no goal that can be an
            episode; or the dataset cannot be written. There is no folder then.
    """
    if find_spec("pyarrow") is None:
        raise ConfigurationError(
            f"LeRobot datasets need pyarrow, not installed here: {install('export')}"
        )
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise InvalidArgumentError(f"{out} exists and is not an empty folder; name another one")
    scan = FileScan()
    tables = list(sample_tables(path, scan))
    if scan.damage:
        raise RecordingError(
            f"{path} is damaged: {scan.damage[0]}; 'bioscara record recover {path} --out FILE' "
            "writes what can be read, which can be exported"
        )
    columns = {name: np.concatenate([each[name] for each in tables]) for name in _names(tables)}
    spans = list(_spans(path, columns))
    if not spans:
        raise RecordingError(f"{path} has no goal that succeeded, to make an episode of")
    _check_rate(fps, columns[_TIME])
    names, notes = _joints(columns, spans)
    episodes, left_out = list[_Episode](), dict[str, list[str]]()
    for span in spans:
        try:
            episodes.append(_episode(span, columns, names, fps))
        except ValueError as error:
            left_out.setdefault(str(error), []).append(f"{span.goal.goal} {span.goal.name}")
    notes += [f"left out, as {why}: {', '.join(goals)}" for why, goals in left_out.items()]
    if not episodes:
        raise RecordingError(f"{path} has no goal that can be an episode: {'; '.join(notes)}")
    try:
        with new_folder(out) as folder:
            frames = _write(folder, episodes, names, fps, path.stem)
    except OSError as error:
        raise RecordingError(f"{out} cannot be written: {error.strerror or error}") from error
    return Dataset(len(episodes), frames, tuple(notes))


def _names(tables: Sequence[Mapping[str, Array]]) -> list[str]:
    known = list(tables[0]) if tables else []
    ends = tuple(_ENDS.values())
    return [name for name in known if name == _TIME or name.endswith(ends)]


def _spans(path: Path, columns: Mapping[str, Array]) -> Iterator[_Span]:
    """Yield the goals that succeeded while samples were recorded, in the order of their ends."""
    begun: dict[int, float] = {}
    first = columns[_TIME][0] if _TIME in columns else np.inf
    for message in messages(path, FileScan(), {Topic.EVENTS}):
        event = message_of(message.data, _Event)
        if event.goal is None:
            continue
        if event.what == "goal_accepted":
            begun[event.goal.goal] = event.time
        elif event.what == "goal_ended" and event.goal.status == "succeeded":
            begin = begun.get(event.goal.goal, event.time)
            if event.time > first:
                yield _Span(event.goal, begin, event.time)


def _check_rate(fps: int, times: Array) -> None:
    rate = round(1.0 / float(np.median(np.diff(times)))) if len(times) > 1 else 1
    if not 1 <= fps <= rate:
        raise InvalidArgumentError(
            f"--fps {fps} is outside 1 .. {rate}, the samples per second of the recording; give a "
            "number between these"
        )


def _joints(columns: Mapping[str, Array], spans: Sequence[_Span]) -> tuple[list[str], list[str]]:
    """Return the names of the joints, with the gripper if its width was known; else a note."""
    end = _ENDS["action"]
    names = [name.removesuffix(end) for name in columns if name.endswith(end)]
    known = ~np.isnan(columns.get(f"{GRIPPER}{end}", np.array([np.nan])))
    if GRIPPER in names and not (known & (columns[_TIME] < spans[-1].end)).any():
        names.remove(GRIPPER)
        return names, ["without the gripper: its width was never commanded"]
    return names, []


def _episode(span: _Span, columns: Mapping[str, Array], names: Sequence[str], fps: int) -> _Episode:
    """Return the frames of a goal; raises ValueError with the reason if it has none."""
    times = columns[_TIME]
    rows = slice(*np.searchsorted(times, (span.begin, span.end)).tolist())
    at = times[rows]
    if np.diff([span.begin, *at, span.end]).max() > _GAP:
        raise ValueError(f"samples of more than {_GAP:g} s are missing")
    used = {f"{name}{end}": name for end in _ENDS.values() for name in names}
    table = np.column_stack([columns[column][rows] for column in used])
    # The setpoints begin a little later than the goal.
    begin = int(np.searchsorted(at, span.begin + _GAP))
    unknown = np.isnan(table)
    if (late := unknown[begin:].any(axis=0)).any():
        name = list(used.values())[int(late.argmax())]
        what = "the width of the jaws" if name == GRIPPER else f"position or command of {name}"
        raise ValueError(f"{what} was unknown")
    whole = ~unknown.any(axis=1)
    at, table = at[whole], table[whole]
    if not len(at):
        raise ValueError("they are shorter than two frames")
    count = int((at[-1] - at[0]) * fps) + 1
    if count < 2:
        raise ValueError("they are shorter than two frames")
    frame_times = at[0] + np.arange(count) / fps
    values = np.column_stack([np.interp(frame_times, at, each) for each in table.T])
    frames = dict(zip(_ENDS, np.split(values, len(_ENDS), axis=1), strict=True))
    return _Episode(span.goal.name.removesuffix("()"), frames)


def _write(
    folder: Path, episodes: Sequence[_Episode], names: Sequence[str], fps: int, title: str
) -> int:
    """Write the files of a dataset; return the number of its frames."""
    # Imported here: they are installed by an extra of their own.
    import pyarrow as pa  # noqa: PLC0415
    import pyarrow.parquet as pq  # noqa: PLC0415

    tasks = list(dict.fromkeys(each.task for each in episodes))
    parts, rows, begin = list[dict[str, Column]](), list[dict[str, Any]](), 0
    for number, episode in enumerate(episodes):
        count, task = len(episode.frames["action"]), tasks.index(episode.task)
        index = np.arange(count)
        part: dict[str, Column] = {
            name: table.astype(np.float32) for name, table in episode.frames.items()
        }
        part["timestamp"] = (index / fps).astype(np.float32)
        part["frame_index"], part["episode_index"] = index, np.full(count, number)
        part["index"], part["task_index"] = begin + index, np.full(count, task)
        parts.append(part)
        rows.append(
            {
                "episode_index": number,
                "tasks": [episode.task],
                "length": count,
                "data/chunk_index": 0,
                "data/file_index": 0,
                "dataset_from_index": begin,
                "dataset_to_index": begin + count,
                **{
                    f"stats/{name}/{key}": values
                    for name, column in part.items()
                    for key, values in _statistics(column).items()
                },
                "meta/episodes/chunk_index": 0,
                "meta/episodes/file_index": 0,
            }
        )
        begin += count
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}

    def array(column: Column) -> Any:
        if column.ndim == 1:
            return pa.array(column)
        return pa.FixedSizeListArray.from_arrays(pa.array(column.ravel()), column.shape[1])

    def write(name: str, table: Any) -> None:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        pq.write_table(table, folder / name, compression="zstd")

    data = {name: array(column) for name, column in columns.items()}
    write(_DATA.format(chunk_index=0, file_index=0), pa.table(data))
    write("meta/episodes/chunk-000/file-000.parquet", pa.Table.from_pylist(rows))
    numbered = pa.table({"task_index": np.arange(len(tasks)), "task": tasks})
    # Pandas, by which LeRobot reads it, takes the texts as the index.
    named = [("task_index", "int64", "int64"), ("task", "unicode", "object")]
    fields = ("name", "pandas_type", "numpy_type")
    described = [dict(zip(fields, each, strict=True)) | {"field_name": each[0]} for each in named]
    metadata = json.dumps({"index_columns": ["task"], "column_indexes": [], "columns": described})
    write("meta/tasks.parquet", numbered.replace_schema_metadata({"pandas": metadata}))
    statistics = {name: _statistics(column) for name, column in columns.items()}
    labels = [f"{name}.pos" for name in names]
    for name, content in (
        ("meta/info.json", _info(columns, len(episodes), len(tasks), labels, fps)),
        ("meta/stats.json", statistics),
    ):
        (folder / name).write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
    card = _CARD.format(title=title, names=", ".join(labels), fps=fps)
    (folder / "README.md").write_text(card, encoding="utf-8")
    return begin


def _info(
    columns: Mapping[str, Column], episodes: int, tasks: int, labels: Sequence[str], fps: int
) -> dict[str, Any]:
    features = {
        name: {
            "dtype": str(column.dtype),
            "shape": [column.shape[1] if column.ndim > 1 else 1],
            "names": list(labels) if column.ndim > 1 else None,
        }
        for name, column in columns.items()
    }
    return {
        "codebase_version": "v3.0",
        "robot_type": "bioscara",
        "total_episodes": episodes,
        "total_frames": len(columns["index"]),
        "total_tasks": tasks,
        "chunks_size": 1000,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 200,
        "fps": fps,
        "splits": {"train": f"0:{episodes}"},
        "data_path": _DATA,
        "video_path": None,
        "features": features,
    }


def _statistics(column: Column) -> dict[str, list[Any]]:
    table = column.reshape(len(column), -1).astype(np.float64)
    return {
        "min": table.min(axis=0).tolist(),
        "max": table.max(axis=0).tolist(),
        "mean": table.mean(axis=0).tolist(),
        "std": table.std(axis=0).tolist(),
        "count": [len(table)],
    }
