"""Parser of arguments that refuses wrong usage in one sentence, with the remedy."""

from __future__ import annotations

import argparse
import contextlib
import shlex
import sys
from collections.abc import Iterable, Sequence
from typing import Any, NoReturn

from bioscara.api import runtime
from bioscara.cli.output.console import ExitStatus, complain
from bioscara.spelling import did_you_mean

_GATEWAYS = ("web", "record", "ros")
"""Commands that an owner can start."""
_RENAMED = {"--speed": ("velocity-scaling", "real-time-factor")}
"""Options that had another name, a factor of two kinds."""


class Parser(argparse.ArgumentParser):
    """argparse, except for its messages, its abbreviations and its negative numbers.

    Unknown words are refused first, with the nearest known one; a refusal is one line, without the
    usage. Options are not abbreviated. Any number may be negative, also -1e-3.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__(allow_abbrev=False, **options)
        self.commands: dict[str, Parser] = {}
        self._default = ""

    def take_commands(self, dest: str, metavar: str, default: str = "") -> None:
        """Let the first word be a command that :meth:`add_command` adds.

        Args:
            dest: Attribute of the options for the name of the command.
            metavar: Name of the argument.
            default: Command that is meant where options come first; empty if none is.
        """
        self._default = default
        # Not required: refuse() reports a missing command, with their names.
        self._added = self.add_subparsers(dest=dest, metavar=metavar, parser_class=Parser)

    def add_command(self, name: str, help_text: str) -> Parser:
        """Add a command, and return the parser of its arguments."""
        parser = self._added.add_parser(
            name, help=help_text, description=help_text, epilog=self.epilog
        )
        self.commands[name] = parser
        return parser

    def read(self, words: Sequence[str], namespace: argparse.Namespace) -> None:
        """Parse the words into ``namespace``; raises SystemExit, status 2, on wrong usage."""
        words = [f" {word}" if _is_negative(word) else word for word in words]
        words = self.completed(words)
        self.refuse(words)
        self.parse_args(words, namespace)

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse the words, and refuse what is left of them.

        A command refuses its own: only its parser knows the option that may have been meant.
        """
        parsed, left = super().parse_known_args(args, namespace)
        if left:
            self._refuse_words(left)
        return parsed, left

    def completed(self, words: list[str]) -> list[str]:
        """Return the words with the commands that are meant by default."""
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
        if isinstance(refused, argparse.ArgumentError):
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

    def _refuse_words(self, words: Sequence[str]) -> NoReturn:
        """Refuse words for which there is no argument."""
        text = " ".join(words).strip()
        remedy = self.as_arm(text) or "leave it out"
        self.error(f"there is nothing to do with {text!r}; {remedy}")

    def _refuse_command(self, word: str) -> NoReturn:
        others = f"there are {', '.join(self.commands)}"
        if self._default and (remedy := self.commands[self._default].as_arm(word)):
            others += f"; {remedy}"
        hint = did_you_mean(word, self.commands, others)
        what = "command" if self._name == self.prog else f"{self._name} command"
        self.error(f"there is no {what} {word!r}; {hint}")

    def as_arm(self, word: str) -> str:
        """Return the remedy if a word can be the name of an arm, else an empty text."""
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


def gateways(word: str) -> list[tuple[str, ...]]:
    """Return the words of the gateways in an argument: their names, or one name with options."""
    try:
        words = shlex.split(word)
    except ValueError as error:
        text = f"{word.strip()!r} cannot be read: {str(error).lower()}"
        raise argparse.ArgumentTypeError(text) from None
    found: list[tuple[str, ...]] = [(name,) for name in word.split(",") if name]
    if len(words) > 1:
        found = [tuple(words)]
    for name, *_ in found:
        if name not in _GATEWAYS:
            hint = did_you_mean(name, _GATEWAYS, f"there are {', '.join(_GATEWAYS)}")
            raise argparse.ArgumentTypeError(f"there is no gateway {name!r}; {hint}")
    return found


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
