"""``bioscara completion``."""

from __future__ import annotations

from bioscara.cli.output.console import Output
from bioscara.cli.parser import Options, Parser


def arguments(parser: Parser) -> None:
    parser.add_argument(
        "shell",
        metavar="SHELL",
        choices=("bash", "zsh", "fish"),
        help="bash, zsh or fish; its line in the start file of the shell, such as ~/.bashrc, is: "
        'eval "$(bioscara completion bash)"; fish: bioscara completion fish | source',
    )


def run(options: Options, output: Output) -> None:
    """Print the script, for the shell to evaluate."""
    from argcomplete.shell_integration import shellcode

    output.lines(shellcode(["bioscara"], shell=options.shell).splitlines())
