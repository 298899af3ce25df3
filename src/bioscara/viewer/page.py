"""The page: the arm in 3D among its surroundings, its nearest pair of bodies, and the readouts."""

from __future__ import annotations

import logging
import socket
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from xml.etree.ElementTree import Element

import numpy as np
import numpy.typing as npt
import rich
import viser
from viser.transforms import SE3, SO3

from bioscara.errors import ConfigurationError
from bioscara.hardware import Urdf
from bioscara.kinematics import Pose, Scara
from bioscara.model import ArmParameters
from bioscara.model.meshes import read_stl
from bioscara.model.urdf import URDF, mesh_file, urdf_of
from bioscara.planning.collision.scene import NearestPair, Scene
from bioscara.viewer import readouts
from bioscara.viewer.access_control import refusing_foreign_requests
from bioscara.viewer.kinematic_tree import KinematicTree
from bioscara.viewer.zones import NEAREST, Mark, add_scene, color_mark

LOOPBACK = "127.0.0.1"
"""The only address that the page is served on, as the page has no authentication."""
_BASE, _TOOL = "base_link", "tool"
"""Links whose frames are the frame of the scene and the pose of the tool."""
_LINKS = {"gripper": ("grp_base_link",), "jaws": ("left_jaw_link", "right_jaw_link"),
          "load": ("grp_base_link",)}  # fmt: skip
"""Links of the description that a body of the collision check is displayed by, where the names
differ."""
_AXES = 0.08
_POINT = 0.008
"""Radius of the ball that marks the tool's point [m]."""
_TRACE, _TRACE_WIDTH = (11, 102, 195), 2.5
_LAST = 1e6
"""Order of the readouts: below all controls."""
_INITIAL_POSITIONS = {"j2": 0.15, "j3": 0.9, "j4": -0.5}
"""Initial positions of joints that do not start in the middle of their range [rad or m]: on a
stretched arm the elbow is not visible."""


class _LoopbackServer(viser.ViserServer):
    """A server without public addresses, which any page in the browser could request."""

    def request_share_url(self, verbose: bool = True) -> str | None:  # noqa: ARG002
        """Refuse the request."""
        return None


class Page:
    """The arm on a page; call :meth:`close` at the end.

    Shows positions; which ones, is decided by :class:`~bioscara.viewer.sliders.Sliders`,
    :class:`~bioscara.viewer.player.Player` or :class:`~bioscara.viewer.live.Live`.

    Args:
        port: TCP port to listen on; the next free one is taken if it is in use, 0 for any.
        scene: Surroundings of the arm.
        arm: The arm with its tool.
        parameters: Parameters of the arm, for its description.

    Attributes:
        tree: Joints and links.
        scene: As given.
        arm: As given.
        gui: Container of the controls.
        positions: Displayed position of each joint, by its name [rad or m].
        nearest: The nearest pair of bodies at these positions; None if there is no pair.

    Raises:
        ConfigurationError: Neither this port nor any above it is free, or the arm has other meshes.
    """

    def __init__(self, port: int, scene: Scene, arm: Scara, parameters: ArmParameters) -> None:
        urdf = Urdf(urdf_of(parameters), URDF.name)
        self.tree, self.scene, self.arm = KinematicTree(urdf), scene, arm
        self.positions = {joint.name: _initial_position(joint.lower, joint.upper, joint.name)
                          for joint in self.tree.free}  # fmt: skip
        self.nearest: NearestPair | None = None
        self._lock = threading.Lock()
        # A browser opens connections that it then does not use: that is no error to print.
        logging.getLogger("websockets.server").setLevel(logging.CRITICAL)
        with _silent_console(), refusing_foreign_requests():
            self._server = _LoopbackServer(host=LOOPBACK, port=_first_free(port), verbose=False)
        self.gui = self._server.gui
        self.gui.configure_theme(show_share_button=False)
        self.gui.main_panel.dock_right()
        self._server.scene.add_grid("/floor", width=2.0, height=2.0, cell_size=0.1)
        self._server.initial_camera.position = (1.0, -0.85, 0.75)
        self._server.initial_camera.look_at = (0.2, 0.03, 0.24)
        self._frames = {name: self._link(name) for name in self.tree.place(self.positions)}
        self._marks: dict[str, list[Mark]] = {}
        for tag in urdf.root.findall("link"):
            self._add_meshes(urdf.attribute(tag, "name"), tag)
        self._add_tool_point()
        for name, mark in add_scene(self._server, f"/{_BASE}", scene).items():
            self._marks[name] = [mark]
        self._marked: frozenset[str] = frozenset()
        self._readouts = self.gui.add_html("", order=_LAST)
        self.show({})

    @property
    def url(self) -> str:
        """Address of the page."""
        return f"http://{LOOPBACK}:{self._server.get_port()}"

    def frames(self) -> Mapping[str, viser.FrameHandle]:
        """Return the displayed frame of each link by name: position [m] and quaternion (w first).

        Both are given in the world frame.
        """
        return self._frames

    def show(self, positions: Mapping[str, float]) -> None:
        """Show the arm at positions of its joints, with its nearest pair and the readouts.

        Args:
            positions: By the joint's name [rad or m]; other joints stay.
        """
        # Sliders call from separate threads: the last position must be the displayed one.
        with self._lock:
            self.positions.update(positions)
            joints = self.joints()
            tool = self.arm.forward(joints)
            links = self.tree.place(self.positions)
            # The description has the fingers; another tool has its point elsewhere.
            links[_TOOL] = links[_BASE] @ _transform(tool)
            self.nearest = self.scene.nearest_pair(self.arm, joints)
            with self._server.atomic():
                for name, frame in self._frames.items():
                    frame.position = links[name].translation()
                    frame.wxyz = links[name].rotation().wxyz
                self._mark_nearest()
            self._readouts.content = readouts.page(self.arm.limits, joints, tool, self.nearest)

    def joints(self) -> tuple[float, ...]:
        """Return the displayed positions of j1 to j4 [rad, m, rad, rad]."""
        return tuple(self.positions[limit.name] for limit in self.arm.limits)

    def show_trace(self, points: npt.NDArray[np.float64]) -> None:
        """Show the path of the tool; replaces the one shown before.

        Args:
            points: Positions of the tool in the base frame, in order [m], shape (n, 3).
        """
        name = f"/{_BASE}/trace"
        if len(points) < 2:
            self._server.scene.remove_by_name(name)
            return
        segments = np.stack((points[:-1], points[1:]), axis=1).astype(np.float32)
        self._server.scene.add_line_segments(
            name, segments, _TRACE, thickness=_TRACE_WIDTH, thickness_units="screen"
        )

    def close(self) -> None:
        """Stop the server."""
        with _silent_console():
            self._server.stop()

    def _mark_nearest(self) -> None:
        pair = self.nearest
        marked = frozenset(
            name
            for body in ((pair.link, pair.other) if pair is not None else ())
            for name in _LINKS.get(body, (body,))
        )
        for name in marked ^ self._marked:
            for mark in self._marks.get(name, ()):
                mark(name in marked)
        self._marked = marked

    def _link(self, name: str) -> viser.FrameHandle:
        return self._server.scene.add_frame(
            f"/{name}", show_axes=name in ("world", _TOOL), axes_length=_AXES,
            axes_radius=_AXES / 25,
        )  # fmt: skip

    def _add_meshes(self, link: str, tag: Element) -> None:
        for number, visual in enumerate(tag.findall("visual")):
            mesh, color = visual.find("geometry/mesh"), visual.find("material/color")
            if mesh is None or color is None:
                continue
            path = mesh_file(mesh.attrib["filename"])
            corners = read_stl(path.read_bytes()).reshape(-1, 3)
            red, green, blue, _ = (
                round(255 * float(each)) for each in color.attrib["rgba"].split()
            )
            handle = self._server.scene.add_mesh_simple(
                f"/{link}/{number}",
                corners,
                np.arange(len(corners)).reshape(-1, 3),
                color=(red, green, blue),
                flat_shading=True,
            )
            self._marks.setdefault(link, []).append(color_mark(handle, (red, green, blue)))

    def _add_tool_point(self) -> None:
        """Add a ball at the tool's point, which has no mesh; visible only while marked."""
        ball = self._server.scene.add_icosphere(
            f"/{_TOOL}/point", radius=_POINT, color=NEAREST, visible=False
        )

        def mark(nearest: bool) -> None:
            ball.visible = nearest

        self._marks["tool"] = [mark]


def _transform(pose: Pose) -> SE3:
    rotation = SO3.from_z_radians(pose.yaw)
    return SE3.from_rotation_and_translation(rotation, np.array(pose[:3]))


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
