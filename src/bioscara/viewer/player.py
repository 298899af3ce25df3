"""Replay of a recorded or planned motion."""

from __future__ import annotations

import math

import numpy as np
import viser

from bioscara.kinematics import batch
from bioscara.viewer import readouts
from bioscara.viewer.page import Page
from bioscara.viewer.played_motion import PlayedMotion

SPEEDS = ("0.1x", "0.25x", "0.5x", "1x", "2x", "5x", "10x")
"""Speeds to choose from, as multiples of real time."""
_STEP = 0.01
_TRACE_MAX = 3000
"""Largest number of points of the displayed tool path."""


class Player:
    """Time slider, play and pause, and speed.

    The controls only store the user's request, :meth:`step` carries it out.

    Args:
        page: The page that shows the motion.
        recording: The motion.

    Attributes:
        time: Displayed time of the motion [s].
        playing: Whether time passes.
    """

    def __init__(self, page: Page, recording: PlayedMotion) -> None:
        self._page, self._recording = page, recording
        self.time, self.playing = recording.start, False
        self._wanted: float | None = None
        self._last = 0.0
        self._shown: tuple[float, bool] | None = None
        gui = page.gui
        gui.add_html(self._heading())
        # Rounded outwards, for short labels; one without extent is no slider.
        first = math.floor(recording.start / _STEP)
        last = max(math.ceil(recording.end / _STEP), first + 1)
        start, end = round(first * _STEP, 2), round(last * _STEP, 2)
        self.slider = gui.add_slider("time [s]", start, end, _STEP, start)
        self.slider.on_update(self._seek)
        self.button = gui.add_button("Play")
        self.button.on_click(lambda _: self.toggle())
        self.speed = gui.add_dropdown("speed", SPEEDS, initial_value="1x")
        self._caption = gui.add_html("")
        thinned = recording.positions[:: -(-len(recording.positions) // _TRACE_MAX)]
        page.show_trace(batch.forward(page.arm, thinned)[:, :3])

    def toggle(self) -> None:
        """Play or pause; at the end, play from the start."""
        if not self.playing and self.time >= self._recording.end:
            self._wanted = self._recording.start
        self.playing = not self.playing

    def seek(self, time: float) -> None:
        """Pause and go to a time of the motion [s]."""
        start, end = self._recording.start, self._recording.end
        self.playing, self._wanted = False, min(max(time, start), end)

    def step(self, now: float) -> None:
        """Let time pass and show the arm; to be called about 30 times a second.

        Args:
            now: Present time [s].
        """
        elapsed, self._last = now - self._last, now
        if self._wanted is not None:
            self.time, self._wanted = self._wanted, None
        elif self.playing:
            self.time += elapsed * float(self.speed.value.rstrip("x"))
        if self.time >= self._recording.end:
            self.time = self._recording.end
            self.playing = False
        if self._shown == (self.time, self.playing):
            return
        self._shown = self.time, self.playing
        names = [limit.name for limit in self._page.arm.limits]
        self._page.show(dict(zip(names, self._recording.at(self.time), strict=True)))
        # Viser's setter does not follow its property, so that mypy does not see it.
        self.slider.value = round(self.time, 2)  # type: ignore[misc]
        self.button.label = "Pause" if self.playing else "Play"
        phase = self._recording.phase(self.time)
        self._caption.content = readouts.text(
            f"{self.time:.2f} of {self._recording.end:.2f} s{phase and f', {phase}'}"
        )

    def _seek(self, event: viser.GuiEvent[viser.GuiSliderHandle[float]]) -> None:
        # Without a client, step() itself moved the slider.
        if event.client_id is not None:
            self.seek(event.target.value)

    def _heading(self) -> str:
        """Return title, notes and the least clearance of the motion."""
        page, recording = self._page, self._recording
        lines = [f"<b>{readouts.plain(recording.title)}</b>", *map(readouts.plain, recording.notes)]
        clearances = page.scene.clearance(page.arm, recording.positions)
        row = int(np.argmin(clearances))
        pair = page.scene.nearest_pair(page.arm, recording.positions[row].tolist())
        if pair is not None:
            lines.append(
                f"least clearance {readouts.length(pair.distance)} at {recording.times[row]:.2f} s "
                f"({readouts.plain(pair.link)} to {readouts.plain(pair.other)})"
            )
        return readouts.text("<br>".join(lines))
