"""The figure of a plan or of samples; imports matplotlib (the extra ``plot``)."""

from __future__ import annotations

import io

# Without pyplot: no display, no global state.
from matplotlib.figure import Figure


class Picture(Figure):
    """A figure that a notebook shows as it is; elsewhere ``savefig(path)`` writes it."""

    def _repr_png_(self) -> bytes:
        data = io.BytesIO()
        self.savefig(data, format="png")
        return data.getvalue()
