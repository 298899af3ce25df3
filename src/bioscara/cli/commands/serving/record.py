"""``bioscara record``."""

from __future__ import annotations

import argparse
import math
import os
from pathlib import Path

from bioscara.api.runtime import DEFAULT
from bioscara.cli.output.console import ExitStatus, Output, complain
from bioscara.cli.parser import Options, Parser, number, whole_number
from bioscara.cli.shared_arguments import ARM_VARIABLE, RECORDINGS, share
from bioscara.errors import RecordingError

_FPS = 30
_SIZES = {"K": 10**3, "M": 10**6, "G": 10**9}


def arguments(parser: Parser) -> None:
    parser.take_commands("action", "ACTION", default="start")
    texts = {
        "start": "Record a served arm until Ctrl-C (the default).",
        "info": "List what a recording contains.",
        "recover": "Complete a recording whose recorder was killed or whose disk was full.",
        "export": "Write samples, events and trajectories as tables with the flight records, or a "
        "LeRobot dataset.",
        "replay": "Serve a recording as an arm that clients can look at but not command.",
    }
    start, info, recover, export, replay = (
        parser.add_command(name, text) for name, text in texts.items()
    )
    _add_start(start)
    for action in (info, recover, export, replay):
        action.add_argument("file", metavar="FILE", type=Path, help="the recording")
    recover.add_argument(
        "--out", metavar="FILE", type=Path, help="file to write (default: replace the given one)"
    )
    kind = export.add_mutually_exclusive_group(required=True)
    kind.add_argument("--csv", metavar="DIR", type=Path, help="folder for CSV files")
    kind.add_argument("--parquet", metavar="DIR", type=Path, help="folder for Parquet files")
    kind.add_argument(
        "--lerobot",
        metavar="DIR",
        type=Path,
        help="new folder for a LeRobot dataset, format 3.0: an episode for each goal that "
        "succeeded",
    )
    export.add_argument(
        "--fps",
        metavar="N",
        type=whole_number,
        help=f"frames per second of the LeRobot dataset (default {_FPS})",
    )
    export.checks.append(_check_fps)
    replay.add_argument(
        "--name", metavar="NAME", default="replay", help="name of the served arm (default replay)"
    )
    replay.add_argument(
        "--real-time-factor",
        metavar="FACTOR",
        type=number,
        default=1.0,
        help="factor to real time, 0.01 to 100 (default 1)",
    )


def _add_start(start: Parser) -> None:
    share(
        start,
        "--arm",
        default=os.environ.get(ARM_VARIABLE) or DEFAULT,
        help=f"name of the arm (default: ${ARM_VARIABLE}, else {DEFAULT})",
    )
    share(start, "--out", default=RECORDINGS, help="folder of the files (default recordings)")
    share(
        start,
        "--camera",
        help="record images of the simulated world, four a second: front, side, top or wrist, with "
        "640x480 pixels if no size is given; the owner needs bioscara[physics-view]",
    )
    start.add_argument(
        "--max-size",
        metavar="SIZE",
        type=_size,
        default=_size("256M"),
        help="size at which the next file begins, as 500K, 256M or 2G (default 256M)",
    )
    start.add_argument(
        "--max-time",
        metavar="S",
        type=_positive,
        default=3600.0,
        help="duration after which the next file begins [s] (default 3600)",
    )
    start.add_argument(
        "--keep",
        metavar="SIZE",
        type=_size,
        default=_size("10G"),
        help="total size of this arm's files in the folder, above which the oldest are deleted "
        "(default 10G)",
    )
    start.checks.append(_check_sizes)


def _check_fps(parser: Parser, options: Options) -> None:
    if options.fps is not None and options.lerobot is None:
        parser.error("--fps applies only to a LeRobot dataset; add --lerobot DIR")


def _check_sizes(parser: Parser, options: Options) -> None:
    if options.keep < options.max_size:
        parser.error("--keep is smaller than --max-size; give a larger one")


def _size(word: str) -> int:
    """Return a number of bytes."""
    factor = _SIZES.get(word[-1:].upper())
    digits = word if factor is None else word[:-1]
    value = number(digits) * (factor or 1)
    if not 1.0 <= value < 2.0**63:
        raise argparse.ArgumentTypeError(f"{word!r} is not a size from 1 byte on")
    return int(value)


def _positive(word: str) -> float:
    value = number(word)
    if not 0.0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"{word!r} is not above zero")
    return value


def run(options: Options, output: Output) -> ExitStatus | None:
    """Record a served arm, or use a recording.

    Raises:
        ConfigurationError: The extra ``export`` is not installed.
        BioscaraError: The arm cannot be recorded, or the recording not be used.
    """
    if options.action == "start":
        return _start(options, output)
    actions = {"info": _info, "recover": _recover, "export": _export, "replay": _replay}
    actions[options.action](options, output)
    return None


def _start(options: Options, output: Output) -> ExitStatus:
    from bioscara.cli.signals import StopRequest
    from bioscara.processes.child_process import Questions
    from bioscara.processes.unread_output import never_wait
    from bioscara.recording.writing.folder import RecordingFolder
    from bioscara.recording.writing.owner_recorder import FileLimits
    from bioscara.recording.writing.recorder import record

    never_wait()
    arm = options.arm or DEFAULT
    folder = RecordingFolder(options.out, arm, options.keep)
    limits = FileLimits(options.max_size, options.max_time)
    Questions().answer_always()
    with StopRequest() as ended:
        try:
            record(arm, folder, limits, ended, output.line, options.camera)
        except RecordingError as error:
            # Not refused: it did record.
            complain(str(error))
            return ExitStatus.FAILED
    return ExitStatus.OK


def _info(options: Options, output: Output) -> None:
    from bioscara.recording.reading.contents import Contents

    output.lines(Contents(options.file).lines())


def _recover(options: Options, output: Output) -> None:
    from bioscara.recording.reading.recovery import recover

    found = recover(options.file, options.out)
    if found.written is None:
        output.line(f"{options.file} is complete: {found.messages} messages")
    else:
        output.line(
            f"{found.written}: {found.messages} messages; {found.lost} bytes were no whole record"
        )
    for what in found.scan.damage:
        output.line(f"warning: {what}")


def _replay(options: Options, output: Output) -> None:
    import asyncio
    import signal

    from bioscara.api.runtime import OwnerClaim
    from bioscara.processes.unread_output import never_wait
    from bioscara.recording.reading.replay import ReplayedArm, serve_recording

    never_wait()
    arm = ReplayedArm(options.file, options.name, options.real_time_factor)
    claim = OwnerClaim(options.name, f"recording {options.file.name}")

    def ready() -> None:
        output.line(f"{arm.description}, which begins when a client connects")
        output.line(f"{arm.name} is served: bioscara status --arm {arm.name}")

    async def until_signal() -> None:
        loop, ended = asyncio.get_running_loop(), asyncio.Event()
        for each in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            loop.add_signal_handler(each, ended.set)
        await serve_recording(arm, claim, ended, ready)

    try:
        asyncio.run(until_signal())
    finally:
        claim.close()


def _export(options: Options, output: Output) -> None:
    from bioscara.recording.reading.export import export_csv, export_parquet
    from bioscara.recording.reading.lerobot import export_lerobot

    if options.lerobot is not None:
        fps = _FPS if options.fps is None else options.fps
        made = export_lerobot(options.file, options.lerobot, fps)
        for note in made.notes:
            output.line(f"note: {note}")
        output.line(f"wrote {options.lerobot}: {made.episodes} episodes, {made.frames} frames")
        return
    if options.csv is not None:
        files = export_csv(options.file, options.csv)
    else:
        files = export_parquet(options.file, options.parquet)
    for file in files:
        output.line(f"wrote {file}")
