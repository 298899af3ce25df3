"""``bioscara service``."""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Iterable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

from bioscara.cli.output.console import ExitStatus, Output, complain
from bioscara.cli.parser import Options, Parser, parse
from bioscara.cli.shared_arguments import share

if TYPE_CHECKING:
    from bioscara.service.files import File
    from bioscara.service.systemd import Command

_BUS, _PRIORITY = "linux:1", 80


def arguments(parser: Parser) -> None:
    parser.take_commands("action", "ACTION")
    install = parser.add_command(
        "install",
        "Serve an arm from the start of the computer on, as a service of systemd; again: bring it "
        "up to date.",
    )
    status = parser.add_command("status", "Show whether an arm's service runs, and its log.")
    uninstall = parser.add_command(
        "uninstall", "Stop and remove an arm's service; calibration and recordings stay."
    )
    for action in (install, status, uninstall):
        action.add_argument("name", metavar="NAME", help="name of the arm")
    install.add_argument(
        "--bus",
        metavar="BUS",
        help=f"bus of the arm, as for bioscara serve (default: that of the installed service, else "
        f"{_BUS})",
    )
    copied = "; the service has its own copy"
    share(install, "--parameters", default=None, help=f"values of this arm{copied}")
    share(install, "--table", help=f"file with the poses{copied}")
    share(install, "--scene", help=f"file with the zones and the table{copied}")
    install.add_argument(
        "--with",
        dest="gateways",
        metavar="LIST",
        action="append",
        default=[],
        help="gateways, as for bioscara serve; repeatable",
    )
    for action in (install, uninstall):
        action.add_argument(
            "--root",
            metavar="DIR",
            type=Path,
            help="change only files, in the file system of another computer that is mounted here",
        )
        action.add_argument(
            "--dry-run", action="store_true", help="print each step, and change nothing"
        )


def run(options: Options, output: Output) -> ExitStatus:
    """Install, describe or remove the service of an arm.

    Raises:
        ConfigurationError: It is refused, or a file cannot be written; nothing has changed.
        InvalidArgumentError: The name cannot be that of an arm.
    """
    from bioscara.api.runtime import require_name

    require_name(options.name)
    if options.action == "install":
        return _install(options, output)
    return (_status if options.action == "status" else _uninstall)(options, output)


def _install(options: Options, output: Output) -> ExitStatus:
    from bioscara.service import files, systemd

    name, root = options.name, options.root or Path("/")
    commands = systemd.after_install(name)
    _check_rights(options, commands)
    files.check_program(image=options.root is not None)
    former = files.read_options(root, name)
    words, kept = _words(options, former)
    output.line(f"options of {name}: {shlex.join(words)}")
    _check_options(options, words)
    given = _given_files(options)
    wanted = [
        *files.shared_files(root),
        *(each for option, path in given.items()
          for each in files.copied_file(root, name, option, path)),
        files.environment_file(root, name, words),
    ]  # fmt: skip
    changed = files.changed(root, wanted)
    _tell_files(output, root, changed, len(wanted) - len(changed), dry=options.dry_run)
    if former is not None and kept:
        output.line(f"kept from {files.within(root, files.environment(name))}: {shlex.join(kept)}")
    if "--parameters" not in words:
        output.line(
            "note: the service has the parameters of the existing arms; --parameters FILE gives it "
            "those of this arm"
        )
    if options.dry_run:
        output.lines(f"would run {shlex.join(command)}" for command in commands)
        return ExitStatus.OK
    running = False
    if options.root is None:
        running = systemd.properties(name).get("ActiveState") == "active"
    files.write(root, changed)
    if options.root is not None:
        _tell_image(output, root, name)
        return ExitStatus.OK
    if not _ran(output, commands):
        complain(
            f"{name} is installed, and not served; bioscara service status {name} has the log; "
            "repeat the installation when the cause is removed"
        )
        return ExitStatus.FAILED
    if running and changed:
        # Not by itself: that would release the joints, and end the motion of a client.
        output.line(
            f"note: {name} runs as before until sudo systemctl restart {files.unit(name)}, which "
            "brings the arm to rest and releases its joints"
        )
    output.line(f"{name} is served: bioscara status --arm {name}")
    output.line(
        "its clients are the members of the group bioscara: sudo usermod -aG bioscara USER, who "
        "logs in again"
    )
    return ExitStatus.OK


def _uninstall(options: Options, output: Output) -> ExitStatus:
    from bioscara.service import files, systemd

    name, root = options.name, options.root or Path("/")
    commands = [systemd.before_uninstall(name), *systemd.after_uninstall()]
    _check_rights(options, commands)
    paths = files.removed_with(root, name)
    if options.dry_run:
        output.lines(f"would run {shlex.join(each)}" for each in commands if not options.root)
        output.lines(f"would remove {files.within(root, path)}" for path in paths)
        return ExitStatus.OK
    if options.root is None and not _ran(output, commands[:1]):
        complain(f"{name} is still installed: its service could not be stopped")
        return ExitStatus.FAILED
    files.remove(root, paths)
    output.lines(f"removed {files.within(root, path)}" for path in paths)
    ran = options.root is not None or _ran(output, commands[1:])
    output.line(
        f"kept: {files.within(root, files.state(name))} with its calibration, poses, recordings "
        "and faults, and the user bioscara, to whom they belong"
    )
    return ExitStatus.OK if ran else ExitStatus.FAILED


def _status(options: Options, output: Output) -> ExitStatus:
    from bioscara.api import messages as m, runtime
    from bioscara.cli.owner_link import asked, linked, state_words
    from bioscara.errors import BioscaraError, ConfigurationError
    from bioscara.service import files, systemd

    name = options.name
    words = files.read_options(Path("/"), name)
    if words is None:
        raise ConfigurationError(
            f"no service of arm {name} is installed; sudo bioscara service install {name} does that"
        )
    systemd.check_commands([("systemctl",), ("journalctl",)])
    unit = systemd.properties(name)
    active = unit.get("ActiveState") == "active"
    output.line(
        f"unit: {files.unit(name)}, {unit.get('ActiveState')} ({unit.get('SubState')}) since "
        f"{unit.get('StateChangeTimestamp') or 'the start'}, {unit.get('UnitFileState')}, "
        f"{unit.get('NRestarts')} restarts, last result {unit.get('Result')}"
    )
    output.line(f"options: {shlex.join(words)}")
    parts = [part for word in words for part in word.split("=", 1)]
    given = dict(pairwise(parts)).get("--parameters")
    output.line(f"parameters: {given or 'those of the existing arms'}")
    # Also where this user serves an arm of the same name.
    os.environ[runtime.VARIABLE] = str(runtime.SERVICES)
    try:
        with linked(name) as link:
            described = asked(link, m.GetDescription(), m.Description)
            state = asked(link, m.GetState(), m.StateSample)
        output.line(f"owner: version {described.software} answers; {state_words(state)}")
    except BioscaraError as error:
        active = False
        output.line(f"owner: does not answer: {error}")
    lines = systemd.log_lines(name) or ["none that this user may read: see it with sudo"]
    output.lines(f"log: {line}" for line in lines)
    return ExitStatus.OK if active else ExitStatus.FAILED


def _check_rights(options: Options, commands: Sequence[Command]) -> None:
    """Raise unless this user can change the service; a dry run needs no rights.

    Raises:
        ConfigurationError: No rights, no systemd, or no folder.
    """
    from bioscara.errors import ConfigurationError
    from bioscara.service.systemd import check_commands

    if options.root is not None:
        if not options.root.is_dir():
            raise ConfigurationError(f"--root {options.root} is no folder; mount the image there")
        options.root = options.root.resolve()
        return
    if options.dry_run:
        return
    if os.geteuid() != 0:
        words = shlex.join((sys.executable, "-m", "bioscara", *options.words))
        raise ConfigurationError(
            f"only root may {options.action} a service; nothing has changed: sudo {words}"
        )
    check_commands(commands)


def _words(options: Options, former: Sequence[str] | None) -> tuple[list[str], list[str]]:
    """Return the options of ``serve``, and those of them that are kept."""
    from bioscara.service import files

    new: dict[str, Sequence[str]] = {}
    if former is None:
        bus = options.bus or _BUS
        new["--bus"] = [bus]
        if bus.startswith("linux:"):
            new["--priority"] = [str(_PRIORITY)]
    elif options.bus:
        new["--bus"] = [options.bus]
    given = _given_files(options)
    root = options.root or Path("/")
    for option, file in files.COPIED.items():
        path = files.state(options.name) / file
        # One from before an uninstallation is used again; the table is made when a pose is taught.
        there = former is None and (option == "--table" or files.within(root, path).exists())
        if option in given or there:
            new[option] = [str(path)]
    if options.gateways:
        new["--with"] = options.gateways
    return files.merged(former or (), new)


def _given_files(options: Options) -> dict[str, Path]:
    given = {
        "--parameters": options.parameters,
        "--table": options.table,
        "--scene": options.scene,
    }
    return {option: path for option, path in given.items() if path is not None}


def _check_options(options: Options, words: Sequence[str]) -> None:
    """Refuse options that ``serve`` refuses, and files that cannot be used or that are hidden.

    Raises:
        ConfigurationError: A file cannot be used.
        InvalidArgumentError: There is no such bus.
    """
    from bioscara.bus.select import open_bus
    from bioscara.errors import ConfigurationError
    from bioscara.model import load_parameters
    from bioscara.planning.files.scene_file import read_scene
    from bioscara.robot.workspace.teach_file import load_table
    from bioscara.robot.workspace.tools import fingers
    from bioscara.service import files

    served = parse(("serve", "--name", options.name, *words))
    if served.bus.partition(":")[0] != "sim":
        open_bus(served.bus, ("sim", "sim:/path.sock"))
    root, given, found = options.root or Path("/"), _given_files(options), {}
    for option in files.COPIED:
        named = getattr(served, option[2:])
        if named is None:
            continue
        path = files.state(options.name) / named
        if files.hidden(path):
            raise ConfigurationError(
                f"{option} {path} is hidden from services; give it as an option of this command, "
                "which copies it"
            )
        found[option] = given.get(option, files.within(root, path))
    parameters = load_parameters(overlay=found.get("--parameters"))
    if (table := found.get("--table")) and (table.exists() or "--table" in given):
        load_table(table, fingers(parameters))
    if scene := found.get("--scene"):
        read_scene(scene)


def _tell_files(
    output: Output, root: Path, changed: Iterable[File], unchanged: int, *, dry: bool
) -> None:
    from bioscara.service.files import within

    for file in changed:
        path = within(root, file.path)
        verb = "replace" if path.exists() else "write"
        output.line(f"would {verb} {path}" if dry else f"{verb} {path}")
    if unchanged:
        output.line(f"{unchanged} files are up to date")


def _tell_image(output: Output, root: Path, name: str) -> None:
    from bioscara.service.files import within
    from bioscara.service.systemd import in_image

    python = Path(sys.executable)
    if not within(root, python).exists():
        output.line(f"note: {root} has no {python}, which the unit starts; install bioscara there")
    output.line("to be run:")
    output.lines(f"  {shlex.join(command)}" for command in in_image(root, name))


def _ran(output: Output, commands: Iterable[Command]) -> bool:
    """Run commands up to the first that fails; return whether all succeeded."""
    from bioscara.service.systemd import problem_of

    for command in commands:
        if problem := problem_of(command):
            complain(f"{shlex.join(command)} failed: {problem}")
            return False
        output.line(f"ran {shlex.join(command)}")
    return True
