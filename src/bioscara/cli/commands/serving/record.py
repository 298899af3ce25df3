"""``bioscara record``."""

from __future__ import annotations

import asyncio
import signal
from pathlib import Path

from bioscara.api.runtime import DEFAULT, OwnerClaim
from bioscara.cli.options import Options
from bioscara.cli.output.console import ExitStatus, Output, complain
from bioscara.cli.signals import StopRequest
from bioscara.errors import RecordingError
from bioscara.recording.reading.contents import Contents
from bioscara.recording.reading.export import export_csv, export_parquet
from bioscara.recording.reading.recovery import recover
from bioscara.recording.reading.replay import ReplayedArm, serve_recording
from bioscara.recording.writing.folder import RecordingFolder
from bioscara.recording.writing.owner_recorder import FileLimits
from bioscara.recording.writing.recorder import record


def run(options: Options) -> int:
    """Record a served arm, or use a recording.

    Raises:
        ConfigurationError: The extra ``export`` is not installed.
        BioscaraError: The arm cannot be recorded, or the recording not be used.
        OSError: Standard output cannot be written.
    """
    output = Output()
    actions = {"info": _info, "recover": _recover, "export": _export, "replay": _replay}
    if options.action == "start":
        status = _start(options, output)
    else:
        status = actions[options.action](options, output)
    output.check()
    return status


def _start(options: Options, output: Output) -> ExitStatus:
    arm = options.arm or DEFAULT
    folder = RecordingFolder(options.out or Path(), arm, options.keep)
    limits = FileLimits(options.max_size, options.max_time)
    with StopRequest() as ended:
        try:
            record(arm, folder, limits, ended, output.line)
        except RecordingError as error:
            # Not refused: it did record.
            complain(str(error))
            return ExitStatus.FAILED
    return ExitStatus.OK


def _info(options: Options, output: Output) -> ExitStatus:
    for line in Contents(options.file).lines():
        output.line(line)
    return ExitStatus.OK


def _recover(options: Options, output: Output) -> ExitStatus:
    found = recover(options.file, options.out)
    if found.written is None:
        output.line(f"{options.file} is complete: {found.messages} messages")
    else:
        output.line(
            f"{found.written}: {found.messages} messages; {found.lost} bytes were no whole record"
        )
    for what in found.scan.damage:
        output.line(f"warning: {what}")
    return ExitStatus.OK


def _replay(options: Options, output: Output) -> ExitStatus:
    arm = ReplayedArm(options.file, options.name, options.real_time_factor)
    claim = OwnerClaim(options.name, f"recording {options.file.name}")

    def ready() -> None:
        output.line(f"{arm.description}, which begins when a client connects")
        output.line(f"{arm.name} is served: bioscara status --arm {arm.name}")

    async def until_signal() -> None:
        loop, ended = asyncio.get_running_loop(), asyncio.Event()
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            loop.add_signal_handler(number, ended.set)
        await serve_recording(arm, claim, ended, ready)

    try:
        asyncio.run(until_signal())
    finally:
        claim.close()
    return ExitStatus.OK


def _export(options: Options, output: Output) -> ExitStatus:
    if options.csv is not None:
        files = export_csv(options.file, options.csv)
    else:
        files = export_parquet(options.file, options.parquet or Path())
    for file in files:
        output.line(f"wrote {file}")
    return ExitStatus.OK
