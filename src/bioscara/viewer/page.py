"""The page: the arm in 3D, and a slider for each joint."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from xml.etree.ElementTree import Element

import numpy as np
import rich
import viser

from bioscara.errors import ConfigurationError
from bioscara.hardware import Urdf
from bioscara.model.meshes import read_stl
from bioscara.model.urdf import DESCRIPTION, URDF
from bioscara.planning.collision.scene import Scene
from bioscara.viewer.access_control import refusing_foreign_requests
from bioscara.viewer.kinematic_tree import KinematicTree
from bioscara.viewer.zones import add_scene

LOOPBACK = "127.0.0.1"
"""The only address that the page is served on, as the page has no authentication."""
_PACKAGE = "package://bioscara_description/"
_BASE = "base_link"
"""Link whose frame is the frame of the scene."""
_STEPS = {"revolute": 0.001, "prismatic": 0.0001}
_UNITS = {"revolute": "rad", "prismatic": "m"}
_AXES = 0.08
_INITIAL_POSITIONS = {"j2": 0.15, "j3": 0.9, "j4": -0.5}
"""Initial positions of joints that do not start in the middle of their range [rad or m]: on a
stretched arm the elbow is not visible."""


class _LoopbackServer(viser.ViserServer):
    """A server without public addresses, which any page in the browser could request."""

    def request_share_url(self, verbose: bool = True) -> str | None:  # noqa: ARG002
        """Refuse the request."""
        return None


class Page:
    """The description of the arm on a page; call :meth:`close` at the end.

    Args:
        port: TCP port to listen on; the next free one is taken if it is in use, 0 for any.
        scene: Surroundings of the arm.

    Attributes:
        tree: Joints and links.
        positions: Position of each slider, by the joint's name [rad or m].
        sliders: The sliders, by the joint's name.

    Raises:
        ConfigurationError: Neither this port nor any above it is free.
    """

    def __init__(self, port: int, scene: Scene) -> None:
        urdf = Urdf.load(URDF)
        self.tree = KinematicTree(urdf)
        self.positions = {joint.name: _initial_position(joint.lower, joint.upper, joint.name)
                          for joint in self.tree.free}  # fmt: skip
        self._lock = threading.Lock()
        with _silent_console(), refusing_foreign_requests():
            self._server = _LoopbackServer(host=LOOPBACK, port=_first_free(port), verbose=False)
        self._server.gui.configure_theme(show_share_button=False)
        self._server.gui.main_panel.dock_right()
        self._server.scene.add_grid("/floor", width=2.0, height=2.0, cell_size=0.1)
        self._server.initial_camera.position = (1.0, -0.85, 0.75)
        self._server.initial_camera.look_at = (0.2, 0.03, 0.24)
        self._frames = {name: self._link(name) for name in self.tree.place(self.positions)}
        for tag in urdf.root.findall("link"):
            self._add_meshes(urdf.attribute(tag, "name"), tag)
        add_scene(self._server, f"/{_BASE}", scene)
        self.sliders = {joint.name: self._slider(joint.name) for joint in self.tree.free}
        self._tool = self._server.gui.add_markdown("")
        self._show()

    @property
    def url(self) -> str:
        """Address of the page."""
        return f"http://{LOOPBACK}:{self._server.get_port()}"

    def frames(self) -> Mapping[str, viser.FrameHandle]:
        """Return the displayed frame of each link by name: position [m] and quaternion (w first).

        Both are given in the world frame.
        """
        return self._frames

    def move(self, joint: str, position: float) -> None:
        """Move a joint as its slider does.

        Args:
            joint: Name of the joint.
            position: Goal position [rad or m].
        """
        # Sliders call from separate threads: the last position must be the displayed one.
        with self._lock:
            self.positions[joint] = position
            self._show()

    def close(self) -> None:
        """Stop the server."""
        with _silent_console():
            self._server.stop()

    def _link(self, name: str) -> viser.FrameHandle:
        return self._server.scene.add_frame(
            f"/{name}", show_axes=name in ("world", "tool_link"), axes_length=_AXES,
            axes_radius=_AXES / 25,
        )  # fmt: skip

    def _add_meshes(self, link: str, tag: Element) -> None:
        for number, visual in enumerate(tag.findall("visual")):
            mesh, color = visual.find("geometry/mesh"), visual.find("material/color")
            if mesh is None or color is None:
                continue
            path = DESCRIPTION / mesh.attrib["filename"].removeprefix(_PACKAGE)
            corners = read_stl(path.read_bytes()).reshape(-1, 3)
            red, green, blue, _ = (
                round(255 * float(each)) for each in color.attrib["rgba"].split()
            )
            self._server.scene.add_mesh_simple(
                f"/{link}/{number}",
                corners,
                np.arange(len(corners)).reshape(-1, 3),
                color=(red, green, blue),
                flat_shading=True,
            )

    def _slider(self, name: str) -> viser.GuiSliderHandle[float]:
        joint = next(joint for joint in self.tree.free if joint.name == name)
        slider = self._server.gui.add_slider(
            f"{name} [{_UNITS[joint.kind]}]",
            min=joint.lower,
            max=joint.upper,
            step=_STEPS[joint.kind],
            initial_value=self.positions[name],
        )
        slider.on_update(lambda _: self.move(name, slider.value))
        return slider

    def _show(self) -> None:
        links = self.tree.place(self.positions)
        with self._server.atomic():
            for name, frame in self._frames.items():
                frame.position = links[name].translation()
                frame.wxyz = links[name].rotation().wxyz
        tool = links["tool_link"]
        x, y, z = tool.translation()
        yaw = tool.rotation().compute_yaw_radians()
        self._tool.content = f"tool: x {x:z.4f}, y {y:z.4f}, z {z:z.4f} m, yaw {yaw:z.4f} rad"


def _first_free(port: int) -> int:
    """Return the first free port from ``port`` on; without a free one, viser would not return."""
    for candidate in range(port, 2**16):
        with socket.socket() as probe:
            # As servers do: a port that the last page left in TIME_WAIT counts as free.
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            with suppress(OSError):
                probe.bind((LOOPBACK, candidate))
                return candidate
    raise ConfigurationError(f"no port from {port} on is free; choose a lower one")


@contextmanager
def _silent_console() -> Iterator[None]:
    """Suppress the messages that viser prints at start and end even if it is not verbose."""
    console = rich.get_console()
    quiet, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = quiet


def _initial_position(lower: float, upper: float, name: str) -> float:
    return _INITIAL_POSITIONS.get(name, round((lower + upper) / 2.0, 3))
