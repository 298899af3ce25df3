"""``bioscara stop``, when the command line has been imported already."""

from __future__ import annotations

from bioscara import stop
from bioscara.cli.options import Options


def run(options: Options) -> int:
    """Stop the motion of an arm, or of all that are served."""
    return stop.main([options.name] if options.name else [])
