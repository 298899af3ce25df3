"""``bioscara view``."""

from __future__ import annotations

import time

from bioscara.cli.arguments import Options
from bioscara.cli.interruption import Interruption
from bioscara.cli.output import Output
from bioscara.cli.status import Status
from bioscara.errors import ConfigurationError


def run(options: Options) -> int:
    """Show the arm's description in the browser until Ctrl-C.

    Raises:
        ConfigurationError: viser is not installed.
        OSError: Standard output cannot be written.
    """
    try:
        # Here and not above: it takes a second to import, and comes with an extra.
        from bioscara.viewer.page import Page  # noqa: PLC0415
    except ModuleNotFoundError as error:
        if error.name != "viser":
            raise
        raise ConfigurationError(
            "the 3D view needs viser, which is not installed: pip install 'bioscara[view]'"
        ) from error
    output = Output()
    page = Page(options.port)
    try:
        with Interruption() as cancelled:
            output.line(f"the arm in 3D: {page.url} (from this computer only; Ctrl-C ends it)")
            while not cancelled():
                time.sleep(0.1)
    finally:
        page.close()
    output.check()
    return Status.OK
