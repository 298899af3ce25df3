"""``python -m bioscara`` is ``bioscara``."""

from __future__ import annotations

import sys

from bioscara.cli import main

if __name__ == "__main__":
    sys.exit(main())
