"""``bioscara`` and ``python -m bioscara``; ``stop`` is apart, as it must be fast."""

from __future__ import annotations

import os
import sys


def main() -> int:
    """Run one command and return its exit status."""
    words = sys.argv[1:]
    if words[:2] == ["stop", "--arm"]:
        # As with all other commands: a person in a hurry does not know that a word is enough.
        del words[1], sys.argv[2]
    if words[:1] == ["stop"] and len(words) <= 2 and not any(map(_needs_all, words)):
        from bioscara.stop import main as stop  # noqa: PLC0415  the others take 10 times as long

        return stop(words[1:])
    # The linear algebra of NumPy starts a thread for each further core, and each spins for 0.1 s,
    # also next to a control loop; the matrices here are too small for them.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        from bioscara.cli import main as command  # noqa: PLC0415

        return command()
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] == __package__:
            raise
        from bioscara.extras import pip_install  # noqa: PLC0415
        from bioscara.version import __version__  # noqa: PLC0415

        remedy = pip_install(f"bioscara=={__version__}")
        sys.stderr.write(f"bioscara: {error.name} is missing, which it needs: {remedy}\n")
        return 2


def _needs_all(word: str) -> bool:
    """Return whether a word of ``stop`` is an option, or the address of a gateway."""
    return word.startswith("-") or "://" in word


if __name__ == "__main__":
    sys.exit(main())
