"""How often laws over random inputs are tried: seldom in ``make test``, often in ``make laws``."""

from __future__ import annotations

import os


def examples(usual: int) -> int:
    """Return the number of examples of an expensive law.

    Args:
        usual: Their number unless ``BIOSCARA_EXAMPLES`` is set, as in ``make laws``.
    """
    return int(os.environ.get("BIOSCARA_EXAMPLES", str(usual)))
