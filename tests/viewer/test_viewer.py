"""The 3D page: it shows the pose of the kinematics, and only to this computer."""

from __future__ import annotations

import math
import socket
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bioscara.hardware import Urdf
from bioscara.kinematics import Geometry, Pose, Scara
from bioscara.model import load_parameters
from bioscara.model.urdf import URDF

viser = pytest.importorskip("viser", reason="pip install 'bioscara[view]': the 3D page")

from bioscara.errors import ConfigurationError  # noqa: E402
from bioscara.planning.collision.scene import Box, Cylinder, Scene  # noqa: E402
from bioscara.robot import kinematics_of  # noqa: E402
from bioscara.viewer.kinematic_tree import KinematicTree  # noqa: E402
from bioscara.viewer.page import Page  # noqa: E402
from bioscara.viewer.sliders import Sliders  # noqa: E402
from bioscara.viewer.zones import edges, solid  # noqa: E402
from viewer.browser import Browser, wait  # noqa: E402

PARAMETERS = load_parameters()
SCENE = Scene(
    (
        Box("reader", (0.3, -0.4, 0.0), (0.6, -0.2, 0.2), yaw=0.3),
        Cylinder("cell", 0.1, 0.0, 0.8, -0.1, 0.9, keep_in=True, links=("tool",)),
    ),
    table_height=-0.05,
)
SHAPE = PARAMETERS.geometry
ARM = Scara(
    Geometry(SHAPE.upper_arm, SHAPE.forearm, SHAPE.height),
    PARAMETERS.joints,
    Pose(SHAPE.tool_x, SHAPE.tool_y, SHAPE.tool_z, 0.0),
)


@pytest.fixture(scope="module")
def page() -> Iterator[Page]:
    page = Page(0, SCENE, ARM, PARAMETERS)
    yield page
    page.close()


@pytest.fixture(scope="module")
def sliders(page: Page) -> Sliders:
    return Sliders(page)


@pytest.fixture
def browser(page: Page) -> Iterator[Browser]:
    browser = Browser(page)
    yield browser
    browser.close()


@contextmanager
def listening(port: int) -> Iterator[int]:
    """Take a port, unless it is taken, and return its number."""
    with socket.socket() as server:
        with suppress(OSError):
            server.bind(("127.0.0.1", port))
            server.listen()
        yield server.getsockname()[1]


def tool(page: Page) -> tuple[Any, float]:
    frame = page.frames()["tool"]
    w, x, y, z = frame.wxyz
    assert (x, y) == pytest.approx((0.0, 0.0), abs=1e-9)
    return frame.position, 2.0 * math.atan2(z, w)


def test_a_slider_moves_the_frames_as_forward_kinematics_says(
    page: Page, sliders: Sliders, browser: Browser
) -> None:
    rng = np.random.default_rng(6)
    for _ in range(5):
        joints = [float(rng.uniform(j.lower, j.upper)) for j in PARAMETERS.joints]
        for limit, value in zip(PARAMETERS.joints, joints, strict=True):
            uuid = sliders.sliders[limit.name]._impl.uuid
            shown = math.degrees(value) if limit.unit == "rad" else 1e3 * value
            browser.say(type="GuiUpdateMessage", uuid=uuid, updates={"value": shown})
        expected = ARM.forward(joints)

        def there(expected: Pose = expected) -> bool:
            position, yaw = tool(page)
            # The last slider turns the tool where it is, so its place alone may be early.
            turned = math.remainder(yaw - expected.yaw, 2 * math.pi)
            return np.allclose(position, expected[:3], atol=1e-9) and abs(turned) < 1e-9

        wait(there)


def test_the_jaws_follow_the_width(page: Page, sliders: Sliders) -> None:
    sliders.move("gripper", 0.1)
    left, right = (page.frames()[f"{side}_jaw_link"].position for side in ("left", "right"))
    assert np.linalg.norm(left - right) == pytest.approx(0.1)


def test_every_joint_has_a_slider_within_its_limits(page: Page, sliders: Sliders) -> None:
    assert set(sliders.sliders) == {"j1", "j2", "j3", "j4", "gripper"}
    for limit in PARAMETERS.joints:
        slider = sliders.sliders[limit.name]
        scale = math.degrees(1.0) if limit.unit == "rad" else 1e3
        bounds = scale * limit.lower, scale * limit.upper
        assert (slider.min, slider.max) == pytest.approx(bounds, abs=0.05)
        for bound, end in ((limit.lower, slider.min - 0.1), (limit.upper, slider.max + 0.1)):
            sliders.move(limit.name, end / scale)
            assert page.positions[limit.name] == bound


def test_zones_are_shown_at_their_positions(page: Page) -> None:
    shown = page._server.scene._handle_from_node_name
    reader, cell, table = (f"/base_link/{name}" for name in ("zone_0", "zone_1", "table"))
    assert f"{cell}/solid" not in shown  # a cell that is filled would hide the arm in it
    assert shown[f"{reader}/solid"].opacity < 0.5
    corners, border = shown[f"{reader}/solid"].vertices, SCENE.zones[0].shape.outline()
    for corner in corners[:, :2]:
        assert np.abs(border - corner).sum(axis=1).min() < 1e-6
    assert np.unique(corners[:, 2]) == pytest.approx([0.0, 0.2])
    points = shown[f"{cell}/edges"].points
    assert np.hypot(points[..., 0] - 0.1, points[..., 1]) == pytest.approx(0.8, abs=1e-6)
    assert (points[..., 2].min(), points[..., 2].max()) == pytest.approx((-0.1, 0.9))
    assert (shown[f"{reader}/name"].text, shown[f"{cell}/name"].text) == ("reader", "cell (tool)")
    top = shown[table].position[2] + shown[table].dimensions[2] / 2.0
    assert top == pytest.approx(-0.05, abs=2e-3)


@pytest.mark.parametrize("zone", SCENE.zones, ids=lambda zone: zone.name)
def test_the_surface_of_a_zone_is_closed_and_faces_outwards(zone: Box | Cylinder) -> None:
    corners, faces = solid(zone.shape)
    ways = [tuple(side) for a, b, c in faces.tolist() for side in ((a, b), (b, c), (c, a))]
    assert len(set(ways)) == len(ways)
    assert {(b, a) for a, b in ways} == set(ways)
    a, b, c = (corners[faces[:, index]].astype(float) for index in range(3))
    volume = np.einsum("ni,ni->n", a, np.cross(b, c)).sum() / 6.0
    size = 0.3 * 0.2 * 0.2 if isinstance(zone, Box) else math.pi * 0.8**2
    assert volume == pytest.approx(size, rel=0.01)
    assert (
        np.unique(edges(zone.shape).reshape(-1, 3), axis=0).shape
        == np.unique(corners, axis=0).shape
    )


def test_the_page_is_served_on_the_loopback_address_only(page: Page) -> None:
    port = int(page.url.rpartition(":")[2])
    with urllib.request.urlopen(page.url) as answer:
        assert answer.status == 200
    # A server on all addresses serves on each of the loopback's.
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.2", port), timeout=1.0)


def test_the_next_free_port_is_used() -> None:
    with listening(0) as taken:
        page = Page(taken, Scene(), ARM, PARAMETERS)
        try:
            assert taken < int(page.url.rpartition(":")[2]) < taken + 1000
        finally:
            page.close()


@pytest.mark.timeout(20)
def test_the_lack_of_a_free_port_is_an_error() -> None:
    with (
        listening(65535),
        pytest.raises(ConfigurationError, match="no port from 65535 on is free; choose a lower"),
    ):
        Page(65535, Scene(), ARM, PARAMETERS)


def test_a_request_for_a_public_address_is_refused(
    page: Page, sliders: Sliders, browser: Browser, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[object] = []

    def tunnel(*arguments: object) -> None:
        opened.append(arguments)
        raise AssertionError("a tunnel was opened")

    monkeypatch.setattr("viser._viser.ViserTunnel", tunnel)
    browser.say(type="ShareUrlRequest")
    # The answer to a later request comes after this request was processed.
    uuid = sliders.sliders["j1"]._impl.uuid
    browser.say(type="GuiUpdateMessage", uuid=uuid, updates={"value": 12.3})
    wait(lambda: page.positions["j1"] == pytest.approx(math.radians(12.3)))
    wait(page._server._thread_executor._work_queue.empty)
    assert opened == []


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        (
            '<link name="base_link">',
            '<link name="lonely"/><link name="base_link">',
            "2 links have no",
        ),
        ('type="prismatic"', 'type="planar"', "type 'planar' is not one of"),
        (
            '<parent link="world"/>',
            '<parent link="link_1"/>',
            "joint base_joint has no parent in the tree",
        ),
        ('<axis xyz="0 0 1"/>', "", "joint j1 has no <axis>"),
    ],
)
def test_a_description_that_is_not_a_tree_is_refused(old: str, new: str, complaint: str) -> None:
    text = URDF.read_text()
    assert old in text
    with pytest.raises(ConfigurationError, match=complaint):
        KinematicTree(Urdf(text.replace(old, new, 1), "arm.urdf"))


OWN = "127.0.0.1:{port}"
FOREIGN = [
    {"Host": "evil.example"},
    {"Host": "evil.example:{port}"},
    {"Host": "127.0.0.1"},
    {"Host": "127.0.0.1:1"},
    {"Host": "127.0.0.1:{port}.evil.example"},
    {"Host": "0.0.0.0:{port}"},
    {"Host": OWN, "Origin": "http://evil.example"},
    {"Host": OWN, "Origin": "https://127.0.0.1:{port}"},
    {"Host": OWN, "Origin": "http://127.0.0.1:1"},
    {"Host": OWN, "Origin": "null"},
    {"Host": OWN, "Origin": "http://evil.example:{port}"},
]
UPGRADE = {
    "Upgrade": "websocket",
    "Connection": "Upgrade",
    "Sec-WebSocket-Version": "13",
    "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
    "Sec-WebSocket-Protocol": f"viser-v{viser.__version__}",
}


def status(page: Page, headers: dict[str, str], *, upgrade: bool) -> int:
    """Return the status of an answer to a request with these headers, byte by byte as given."""
    port = int(page.url.rpartition(":")[2])
    lines = ["GET / HTTP/1.1"]
    for name, value in {**headers, **(UPGRADE if upgrade else {"Connection": "close"})}.items():
        lines.append(f"{name}: {value.format(port=port)}")
    with socket.create_connection(("127.0.0.1", port), timeout=10.0) as connection:
        connection.sendall("\r\n".join([*lines, "", ""]).encode())
        return int(connection.recv(100).split()[1])


@pytest.mark.parametrize("upgrade", [False, True], ids=["HTTP", "WebSocket"])
@pytest.mark.parametrize("headers", [*FOREIGN, {}])
def test_requests_of_other_sites_are_refused(
    page: Page, headers: dict[str, str], upgrade: bool
) -> None:
    assert status(page, headers, upgrade=upgrade) == 403


@pytest.mark.parametrize("upgrade", [False, True], ids=["HTTP", "WebSocket"])
@pytest.mark.parametrize("name", ["127.0.0.1", "localhost", "LOCALHOST"])
def test_the_page_itself_is_served(page: Page, name: str, upgrade: bool) -> None:
    host = f"{name}:{{port}}"
    for headers in ({"Host": host}, {"Host": host, "Origin": f"http://{host}"}):
        assert status(page, headers, upgrade=upgrade) == (101 if upgrade else 200)


def test_the_page_shows_the_arm_with_its_own_values() -> None:
    j1, *others = PARAMETERS.joints
    parameters = replace(
        PARAMETERS,
        joints=(replace(j1, lower=-2.0), *others),
        geometry=replace(SHAPE, height=0.15, tool_x=0.13),
    )
    page = Page(0, Scene(), kinematics_of(parameters), parameters)
    try:
        page.show({"j1": 0.0, "j2": 0.1, "j3": 0.0, "j4": 0.0})
        assert {joint.name: joint.lower for joint in page.tree.free}["j1"] == -2.0
        assert page.frames()["link_4"].position[2] == pytest.approx(0.25)
        place = page.tree.place(page.positions)["tool"].translation()
        assert place == pytest.approx(page.frames()["tool"].position)
    finally:
        page.close()
