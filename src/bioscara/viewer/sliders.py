"""A slider for each joint."""

from __future__ import annotations

import math

import viser

from bioscara.viewer.page import Page

_STEPS = {"revolute": 0.1, "prismatic": 0.1}
_SCALES = {"revolute": math.degrees(1.0), "prismatic": 1e3}
_UNITS = {"revolute": "deg", "prismatic": "mm"}


class Sliders:
    """Lets the user move each joint of the page within its limits.

    Args:
        page: The page.

    Attributes:
        sliders: By the joint's name; in degrees or millimetres.
    """

    def __init__(self, page: Page) -> None:
        self._page = page
        self._joints = {joint.name: joint for joint in page.tree.free}
        self.sliders = {name: self._slider(name) for name in self._joints}

    def move(self, joint: str, position: float) -> None:
        """Move a joint as its slider does.

        Args:
            joint: Name of the joint.
            position: Goal position [rad or m]; beyond a limit, the limit.
        """
        limits = self._joints[joint]
        # A slider's end is rounded, and its steps may pass it.
        self._page.show({joint: min(max(position, limits.lower), limits.upper)})

    def step(self, now: float) -> None:
        """Do nothing: the sliders act in callbacks."""

    def _slider(self, name: str) -> viser.GuiSliderHandle[float]:
        joint = self._joints[name]
        scale = _SCALES[joint.kind]
        slider = self._page.gui.add_slider(
            f"{name} [{_UNITS[joint.kind]}]",
            min=round(scale * joint.lower, 1),
            max=round(scale * joint.upper, 1),
            step=_STEPS[joint.kind],
            initial_value=round(scale * self._page.positions[name], 1),
        )
        slider.on_update(lambda _: self.move(name, slider.value / scale))
        return slider
