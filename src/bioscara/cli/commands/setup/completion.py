"""``bioscara completion``."""

from __future__ import annotations

from bioscara.cli.output.console import Output
from bioscara.cli.parser import Options, Parser


def arguments(parser: Parser) -> None:
    parser.add_argument(
        "shell",
        metavar="SHELL",
        choices=("bash", "zsh", "fish"),
        help='bash, zsh or fish; its script is for eval "$(bioscara completion bash)" in ~/.bashrc, '
        "or likewise in ~/.zshrc, and as ~/.config/fish/completions/bioscara.fish",
    )


def run(options: Options, output: Output) -> None:
    """Print the script, for the shell to evaluate."""
    import argcomplete

    output.lines(argcomplete.shellcode(["bioscara"], shell=options.shell).splitlines())
