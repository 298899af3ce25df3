"""Parser of arguments that refuses wrong usage in one sentence, with the remedy."""

from __future__ import annotations

import argparse
import contextlib
import importlib
import shlex
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, NoReturn

from bioscara.cli.commands import COMMANDS
from bioscara.cli.output.console import ExitStatus, Output, complain
from bioscara.spelling import did_you_mean
from bioscara.version import __version__

EPILOG = (
    "Exit status: 0 done; 1 something failed after the arm began to move or a board was written; "
    "2 wrong usage, or refused before that; 130 interrupted."
)
HELP = "help"
"""First word that is the same as ``--help`` at the end."""
_RENAMED = {"--speed": ("velocity-scaling", "real-time-factor")}
"""Options that had another name, a factor of two kinds."""


Run = Callable[["Options", Output], ExitStatus | None]
"""Carries a command out."""


class Options(argparse.Namespace):
    """The parsed arguments of a command.

    Each command has those that its module and the groups name that it uses. Of those that are read
    for several commands, these are the values for a command that does not have them.

    Attributes:
        command: Name of the command.
        run: Carries it out, and returns its exit status; None for OK.
        words: All arguments after ``bioscara``, as typed.
        paced: Whether a simulated trajectory runs in real time.
        world: What surrounds the arm, a file or a World; None for nothing.
        bus: Name of the bus.
        arm: Name of the owner whose arm is used, or the address of its gateway; None for an arm of
            this process.
        token_file: File with the token for a gateway.
        ca_file: Certificates of the authorities that are trusted for a gateway.
        fingerprint: Fingerprint of the gateway's certificate.
        served: Names of the arms that are served while the command simulates one of its own.
        parameters: File with the values in which the arm differs from the committed ones, if any.
    """

    command: str
    run: Run
    words: Sequence[str] = ()
    paced: bool = True
    world: Any = None
    bus: str = "sim"
    arm: str | None = None
    token_file: Path | None = None
    ca_file: Path | None = None
    fingerprint: str | None = None
    served: Sequence[str] = ()
    parameters: Path | None = None
    v1: bool = False
    homed: bool = False
    rate: int | None = None
    priority: int | None = None
    realtime: bool = False
    full_speed: bool = False
    start: Sequence[float] | None = None
    table: Path | None = None
    scene: Path | None = None

    @property
    def surroundings(self) -> object:
        """What ``--scene`` or ``--world`` names, whichever is given."""
        return self.world or self.scene

    def typed(self, *more: str) -> str:
        """Return the command as typed, with further words, for a shell."""
        return shlex.join(("bioscara", *self.words, *more))


class Parser(argparse.ArgumentParser):
    """argparse, except for its messages, its abbreviations and its negative numbers.

    Unknown words are refused first, with the nearest known one; a refusal is one line, without the
    usage. Options are not abbreviated. Any number may be negative, also -1e-3.

    Attributes:
        commands: The parsers of the commands, by name.
        checks: Complete the options of the command, and refuse those that exclude one another.
        explain: Return what stray words were meant to be, with the parsed options; or an empty
            text.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__(allow_abbrev=False, **options)
        self.commands: dict[str, Parser] = {}
        self.checks: list[Callable[[Parser, Options], None]] = []
        self.explain: Callable[[Options, Sequence[str]], str] = lambda *_: ""
        self._dest = self._default = ""
        self._left: tuple[str, str, str] | None = None

    def take_commands(self, dest: str, metavar: str, default: str = "") -> None:
        """Let the first word be a command that :meth:`add_command` adds.

        Args:
            dest: Attribute of the options for the name of the command.
            metavar: Name of the argument.
            default: Command that is meant where options come first; empty if none is.
        """
        self._dest, self._default = dest, default
        # Not required: refuse() reports a missing command, with their names.
        self._added = self.add_subparsers(dest=dest, metavar=metavar, parser_class=Parser)

    def add_command(self, name: str, help_text: str) -> Parser:
        """Add a command, and return the parser of its arguments."""
        parser = self._added.add_parser(
            name, help=help_text, description=help_text, epilog=self.epilog
        )
        self.commands[name] = parser
        return parser

    def leave(self, dest: str, begin: str, end: str) -> None:
        """Leave the words from ``begin`` up to ``end`` to another program, as option ``dest``."""
        self._left = (dest, begin, end)
        self.set_defaults(**{dest: []})

    def read(self, words: Sequence[str], options: Options) -> None:
        """Parse the words into ``options``; raises SystemExit, status 2, on wrong usage."""
        words = self.completed(list(words))
        words = [f" {word}" if _is_negative(word) else word for word in words]
        self.refuse(words)
        self.parse_args(words, options)
        self.check(options)

    def check(self, options: Options) -> None:
        """Complete the options, and refuse those that exclude one another."""
        for check in self.checks:
            check(self, options)
        if self.commands:
            self.commands[getattr(options, self._dest)].check(options)

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse the words, and refuse the rest of them.

        A command refuses its own: only its parser knows the option that may have been meant.
        """
        parsed, left = super().parse_known_args(args, namespace)
        if left:
            self._refuse_words(left, parsed)
        return parsed, left

    def completed(self, words: list[str]) -> list[str]:
        """Return the words with the commands that are meant by default, without those left."""
        if self._left is not None and self._left[1] in words:
            dest, first, last = self._left
            begin = words.index(first)
            end = words.index(last, begin) if last in words[begin:] else len(words)
            self.set_defaults(**{dest: words[begin:end]})
            words = words[:begin] + words[end + 1 :]
        if self._default and (not words or words[0].startswith("-")):
            return words if {"-h", "--help"} & set(words) else [self._default, *words]
        if words and words[0] in self.commands:
            return [words[0], *self.commands[words[0]].completed(words[1:])]
        return words

    def refuse(self, words: Sequence[str]) -> None:
        """Refuse an unknown command or option, with the nearest known one."""
        for index, word in enumerate(words):
            name = word.partition("=")[0]
            if word == "--":
                break
            if word in {"-h", "--help"}:
                return
            if word.startswith("-") and word != "-" and name not in self._option_string_actions:
                self._refuse_option(name)
            if self.commands and not word.startswith("-"):
                if word not in self.commands:
                    self._refuse_command(word)
                self.commands[word].refuse(words[index + 1 :])
                return
        if self.commands and not {"--version"} & set(words):
            self.error(f"give a command: {', '.join(self.commands)}")

    def error(self, message: str) -> NoReturn:
        """Print one line and end the program with status 2."""
        refused = sys.exc_info()[1]
        # Of Python 3.13, also of what is missing, without a name.
        if isinstance(refused, argparse.ArgumentError) and refused.argument_name is not None:
            message = self._explained(refused)
        for prefix, explain in (
            ("the following arguments are required: ", self._missing),
            ("one of the arguments ", self._choice),
        ):
            if message.startswith(prefix):
                message = explain(message.removeprefix(prefix))
        # After a suggestion, the page of help is not needed.
        complain(message if message.endswith("?") else f"{message}; see {self.prog} --help")
        raise SystemExit(int(ExitStatus.REFUSED))

    @property
    def _name(self) -> str:
        """The command, without the name of the program."""
        return self.prog.partition(" ")[2] or self.prog

    def _refuse_option(self, word: str) -> NoReturn:
        known = [name[2:] for name in self._option_string_actions if name.startswith("--")]
        near = did_you_mean(word.lstrip("-"), known)
        near = next((f"write --{new}" for new in _RENAMED.get(word, ()) if new in known), near)
        others = "its options are " + " ".join(f"--{name}" for name in known if name != "help")
        hint = near.replace("mean ", "mean --") or others
        self.error(f"{self._name} has no option {word}; {hint}")

    def _refuse_words(self, words: Sequence[str], options: Options) -> NoReturn:
        """Refuse words for which there is no argument."""
        words = [word.strip() for word in words]
        text = " ".join(words)
        meant = self.explain(options, words) or (f"bioscara {text}" if text in COMMANDS else "")
        hint = f"did you mean {meant}?" if meant else self.as_arm(text) or "leave it out"
        self.error(f"there is nothing to do with {text!r}; {hint}")

    def _refuse_command(self, word: str) -> NoReturn:
        others = f"there are {', '.join(self.commands)}"
        if self._default and (remedy := self.commands[self._default].as_arm(word)):
            others += f"; {remedy}"
        hint = did_you_mean(word, self.commands, others)
        what = "command" if self._name == self.prog else f"{self._name} command"
        self.error(f"there is no {what} {word!r}; {hint}")

    def as_arm(self, word: str) -> str:
        """Return the remedy if a word can be the name of an arm, else an empty text."""
        # Imported here: needed for this message alone.
        from bioscara.api import runtime  # noqa: PLC0415

        takes_arm = "--arm" in self._option_string_actions and runtime.is_name(word)
        return f"an arm is named by --arm {word}" if takes_arm else ""

    def _explained(self, refused: argparse.ArgumentError) -> str:
        """Return the message for an argument with no, too few or wrong values."""
        action = self._action(refused.argument_name or "")
        if action is None:
            return str(refused)
        name, usage = refused.argument_name, _usage(action)
        other = refused.message.removeprefix("not allowed with argument ")
        if other != refused.message:
            return f"{name} and {other} exclude one another; leave out one of them"
        if refused.message.startswith("ignored explicit argument "):
            return f"{name} takes no value; leave it out"
        if refused.message.startswith("invalid choice: "):
            return f"{name} is one of {', '.join(map(str, action.choices or ()))}: {action.help}"
        if refused.message.startswith("expected "):
            few = "has too few values" if action.nargs else "has no value"
            return f"{name} {few}; give {usage}: {action.help}"
        return f"{name}: {refused.message}; give {usage}: {action.help}"

    def _missing(self, names: str) -> str:
        """Return the message for arguments that are required."""
        actions = [self._action(name, required=True) for name in names.split(", ")]
        usages = [f"{_usage(action)}: {action.help}" for action in actions if action]
        return f"{self._name} needs {'; and '.join(usages)}"

    def _choice(self, message: str) -> str:
        """Return the message for a group of which one argument is required."""
        names = message.removesuffix(" is required").split()
        usages = [_usage(action) for action in map(self._action, names) if action]
        return f"{self._name} needs one of {', '.join(usages)}"

    def _action(self, name: str, *, required: bool = False) -> argparse.Action | None:
        for action in self._actions:
            if required and not action.required:
                continue
            names = {action.metavar, action.dest, "/".join(action.option_strings)}
            if name in names or name in action.option_strings:
                return action
        return None


def parse(arguments: Sequence[str] | None = None) -> Options:
    """Parse the options; raises ``SystemExit`` with status 2 on wrong usage.

    Args:
        arguments: The arguments after ``bioscara``; those of the process by default.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    if words[:1] == [HELP]:
        words = [*[word for word in words if word != HELP], "--help"]
    options = Options(words=words)
    parser, run = parser_for(words[0] if words else "")
    if run is not None:
        options.run = run
    parser.read(words, options)
    return options


def parser_for(command: str) -> tuple[Parser, Run | None]:
    """Return the parser with the arguments of a command, and what carries it out, if there is one.

    Those of the other commands are left out, so that their modules are not imported.
    """
    parser = Parser(
        prog="bioscara", description="Move a Bioscara arm, simulated or real.", epilog=EPILOG
    )
    parser.add_argument("--version", action="version", version=f"bioscara {__version__}")
    parser.take_commands("command", "COMMAND")
    for name, (_, help_text) in COMMANDS.items():
        parser.add_command(name, help_text)
    if command not in COMMANDS:
        return parser, None
    module = importlib.import_module(f"bioscara.cli.commands.{COMMANDS[command][0]}")
    module.arguments(parser.commands[command])
    return parser, module.run


def number(word: str) -> float:
    """Return the number in an argument."""
    with contextlib.suppress(ValueError):
        return float(word)
    raise argparse.ArgumentTypeError(f"{word.strip()!r} is not a number")


def whole_number(word: str) -> int:
    """Return the whole number in an argument."""
    with contextlib.suppress(ValueError):
        return int(word)
    raise argparse.ArgumentTypeError(f"{word.strip()!r} is not a whole number")


def _is_negative(word: str) -> bool:
    # A leading space keeps argparse from reading the number as an option.
    with contextlib.suppress(ValueError):
        float(word)
        return word.startswith("-")
    return False


def _usage(action: argparse.Action) -> str:
    if action.nargs == 0:
        return action.option_strings[0]
    metavar: str | Iterable[str] = action.metavar or action.dest
    values = [metavar] if isinstance(metavar, str) else metavar
    return " ".join([*action.option_strings[:1], *values])
