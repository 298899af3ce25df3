"""Display of an arm that moves now."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence

import numpy as np

from bioscara.errors import BusUnavailableError
from bioscara.viewer import readouts
from bioscara.viewer.page import Page

_RETRY = 1.0
"""Time from a failed look to the next [s]."""
_TRACE_POINTS, _TRACE_STEP = 2000, 1e-3
"""Largest number of points of the displayed tool path, and their least distance [m]."""


class Live:
    """Shows the positions of an arm as they are, and the path of its tool since the page opened.

    Args:
        page: The page.
        title: Which arm it is, in words.
        look: Returns the arm's time [s] and the positions of j1 to j4 [rad, m, rad, rad]; raises
            BusUnavailableError while there is no arm.
    """

    def __init__(
        self, page: Page, title: str, look: Callable[[], tuple[float, Sequence[float]]]
    ) -> None:
        self._page, self._title, self._look = page, title, look
        self._status = page.gui.add_html("")
        self._next, self._time = 0.0, 0.0
        self._trace: deque[tuple[float, float, float]] = deque(maxlen=_TRACE_POINTS)

    def step(self, now: float) -> None:
        """Look at the arm and show it; to be called about 30 times a second.

        Args:
            now: Present time [s].
        """
        if now < self._next:
            return
        try:
            time, joints = self._look()
        except BusUnavailableError as error:
            self._next = now + _RETRY
            self._report(f"{error} (this page waits for it)")
            return
        if time < self._time:  # another arm, or the same one restarted
            self._trace.clear()
        self._time = time
        names = [limit.name for limit in self._page.arm.limits]
        self._page.show(dict(zip(names, joints, strict=True)))
        self._extend_trace(joints)
        self._report(f"{time:.1f} s of its time")

    def _extend_trace(self, joints: Sequence[float]) -> None:
        x, y, z, _ = self._page.arm.forward(joints)
        if self._trace and np.linalg.norm(np.subtract(self._trace[-1], (x, y, z))) < _TRACE_STEP:
            return
        self._trace.append((x, y, z))
        self._page.show_trace(np.array(self._trace))

    def _report(self, status: str) -> None:
        lines = f"<b>{readouts.plain(self._title)}</b>", readouts.plain(status)
        self._status.content = readouts.text("<br>".join(lines))
