"""The server of ``bioscara view``: its answers, and their receivers."""

from __future__ import annotations

from collections.abc import Iterator

import httpx
import pytest

from bioscara.api.values import workspace_value
from bioscara.cli.shared_arguments import START
from bioscara.dashboard.clearance import clearance
from bioscara.dashboard.viewed import Viewed
from bioscara.errors import BusUnavailableError
from bioscara.model import load_parameters
from bioscara.planning.collision.scene import Box, Scene
from bioscara.robot.workspace.workspace import Workspace
from bioscara.web.viewer import Look, ViewServer
from web.gateways import LIMIT, running_gateway

PARAMETERS = load_parameters()
SPACE = Workspace.of(PARAMETERS).with_scene(Scene((Box("rack", (0.05, 0.3, 0), (0.15, 0.4, 0.4)),)))
VIEWED = Viewed("an arm", PARAMETERS, workspace_value(SPACE, 0), START)
PATHS = ("/api/viewed", "/api/viewed/now", "/api/clearance?joints=0", "/api/model", "/api/absent")


def look() -> tuple[float, tuple[float, ...]]:
    if not positions:
        raise BusUnavailableError("no arm here")
    return 7.0, positions[0]


positions: list[tuple[float, ...]] = []


@pytest.fixture(scope="module", params=[None, look], ids=["still", "live"])
def server(request: pytest.FixtureRequest) -> Iterator[ViewServer]:
    given: Look | None = request.param
    with running_gateway(ViewServer(0, VIEWED, given)) as made:
        yield made


def client(
    server: ViewServer, headers: dict[str, str] | None = None, *, token: bool = True
) -> httpx.Client:
    address, _, fragment = server.url.partition("viewer.html#")
    given = {"Authorization": f"Bearer {fragment.removeprefix('token=')}"} if token else {}
    return httpx.Client(base_url=address, headers={**given, **(headers or {})}, timeout=LIMIT)


def test_without_the_token_there_is_only_the_empty_page(server: ViewServer) -> None:
    with client(server, token=False) as anyone:
        assert anyone.get("/viewer.html").status_code == 200
        assert [anyone.get(path).status_code for path in PATHS] == [401] * len(PATHS)


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Host": "evil.example"}, 421),
        ({"Host": "0.0.0.0"}, 421),
        ({"Origin": "http://evil.example"}, 403),
        ({"Origin": "null"}, 403),
        ({"Sec-Fetch-Site": "cross-site"}, 403),
    ],
)
def test_requests_of_other_sites_are_refused(
    headers: dict[str, str], status: int, server: ViewServer
) -> None:
    with client(server, headers) as foreign:
        assert [foreign.get(path).status_code for path in PATHS] == [status] * len(PATHS)


def test_only_this_computer_reaches_it(server: ViewServer) -> None:
    assert server._listener.getsockname()[0] == "127.0.0.1"


def test_nothing_can_be_commanded(server: ViewServer) -> None:
    with client(server) as viewer:
        assert viewer.get("/session").json()["scope"] == "view"
        for path in ("/api/stop", "/api/viewed", "/api/trajectories", "/ws"):
            assert viewer.post(path, json={}).status_code in {404, 405}


def test_the_clearance_is_that_of_the_given_positions(server: ViewServer) -> None:
    joints = (0.9, 0.2, 0.4, 0.0)
    with client(server) as viewer:
        found = viewer.get("/api/clearance", params={"joints": [*joints]}).json()
        refused = viewer.get("/api/clearance", params={"joints": "x"})
    expected = clearance(PARAMETERS, VIEWED.workspace, joints)
    assert (found["link"], found["other"]) == (expected.link, "rack")
    assert found["distance"] == pytest.approx(expected.distance)
    assert refused.status_code == 422


def test_a_moving_arm_is_where_it_is_and_is_waited_for() -> None:
    with running_gateway(ViewServer(0, VIEWED, look)) as server, client(server) as viewer:
        waits = viewer.get("/api/viewed/now").json()
        assert (waits["positions"], waits["problem"]) == ([], "no arm here")
        positions.append((0.1, 0.2, 0.3, 0.4))
        assert viewer.get("/api/viewed/now").json() == {
            "time": 7.0, "positions": [0.1, 0.2, 0.3, 0.4], "problem": ""
        }  # fmt: skip
        positions.clear()


def test_two_views_at_once_do_not_sign_each_other_out() -> None:
    with (
        running_gateway(ViewServer(0, VIEWED)) as one,
        running_gateway(ViewServer(0, VIEWED)) as other,
        httpx.Client(timeout=LIMIT) as browser,
    ):
        for server in (one, other):
            address, _, given = server.url.partition("viewer.html#")
            browser.headers["Origin"] = address.rstrip("/")
            assert (
                browser.post(
                    f"{address}session", json={"token": given.removeprefix("token=")}
                ).status_code
                == 200
            )
        for server in (one, other):
            address = server.url.partition("viewer.html")[0]
            browser.headers["Origin"] = address.rstrip("/")
            assert browser.get(f"{address}api/viewed").status_code == 200
