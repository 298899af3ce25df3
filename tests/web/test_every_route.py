"""No route without a check: each route with each credential, and from each foreign place."""

from __future__ import annotations

import re
import socket
from collections.abc import Iterator
from typing import Any, NamedTuple

import httpx
import pytest
from starlette.routing import WebSocketRoute

from bioscara.robot.tasks.scope import Scope
from bioscara.web.access.browser_sessions import LIFETIME
from bioscara.web.access.rate_limit import RateLimits
from bioscara.web.routes.page import ASSETS
from entries import entry
from web.gateways import LIMIT, Site, site


class Expected(NamedTuple):
    """The status of a route.

    Attributes:
        anonymous: Without a credential.
        viewer: With the token to look.
        operator: With the token to operate.
    """

    anonymous: int
    viewer: int
    operator: int


OPEN, VIEWER = Expected(200, 200, 200), Expected(401, 200, 200)
PAGE = {f"GET {path}": OPEN for path in ASSETS}
ABSENT = Expected(401, 404, 404)
EXPECTED = {
    "GET /": OPEN,
    "GET /icon.svg": OPEN,
    "GET /js/main.js": OPEN,
    "GET /healthz": OPEN,
    "GET /session": OPEN,
    "POST /session": Expected(403, 401, 401),  # Of a browser alone, and with a token in its body.
    "DELETE /session": Expected(403, 200, 200),
    "GET /api/state": VIEWER,
    "GET /api/description": VIEWER,
    "GET /api/faults": VIEWER,
    "GET /api/goals": VIEWER,
    "GET /api/statistics": VIEWER,
    "GET /api/flight-records": VIEWER,
    "GET /api/flight-records/{name}": ABSENT,
    "GET /api/model": VIEWER,
    "GET /api/meshes/{name}": ABSENT,
    "GET /api/clearance": VIEWER,
    "GET /api/parameters": VIEWER,
    "POST /api/parameters/check": Expected(401, 422, 422),  # Without changes in its body.
    "GET /api/recordings": VIEWER,
    "GET /api/recordings/{name}": ABSENT,
    "GET /api/recordings/{name}/samples": ABSENT,
    "GET /api/arms": VIEWER,
    "POST /api/arms/stop": VIEWER,
    "POST /api/arms/{name}/stop": ABSENT,
    "POST /api/trajectories": VIEWER,  # Without a file in its body: a verdict on that.
    "POST /api/sequences/read": VIEWER,
    "POST /api/sequences/write": Expected(401, 422, 422),  # Without JSON in its body.
    "POST /api/sequences/script": Expected(401, 422, 422),
    "POST /api/sequences/plan": Expected(401, 422, 422),
    "GET /openapi.json": VIEWER,
    "POST /api/stop": VIEWER,
    "WEBSOCKET /ws": Expected(401, 101, 101),
}
"""Each route of the gateway, and of the files of its page a few. A new one is added here with what
it asks for."""
FOREIGN = {
    "another site": ({"Origin": "https://evil.example"}, 403),
    "a sandboxed page": ({"Origin": "null"}, 403),
    "another port": ({"Origin": "http://127.0.0.1:1"}, 403),
    "another scheme": ({"Origin": "https://{host}"}, 403),
    "another host": ({"Host": "evil.example"}, 421),
    "a name that resolves here": ({"Host": "rebound.example:{port}"}, 421),
    "a name that ends like ours": ({"Host": "evil{host}"}, 421),
    "no port": ({"Host": "127.0.0.1"}, 421),
}
"""Headers of requests that come from elsewhere, and the answer."""


def routes(made: Site) -> list[str]:
    found = []
    for route in made.gateway.app.routes:
        assert hasattr(route, "path"), f"{route} is no plain route: extend this test"
        if isinstance(route, WebSocketRoute):
            found.append(f"WEBSOCKET {route.path}")
        else:
            methods = set(getattr(route, "methods", None) or ()) - {"HEAD"}
            assert methods, f"{route.path} takes no method: extend this test"
            found += [f"{method} {route.path}" for method in methods]
    return found


@pytest.fixture(scope="module")
def own() -> Iterator[Site]:
    """A gateway without limits of rates, which many tests share."""
    with pytest.MonkeyPatch.context() as patch, site("own") as made:
        patch.setattr(RateLimits, "take", lambda *_: True)
        yield made


def status(made: Site, route: str, headers: dict[str, str]) -> int:
    method, _, path = route.partition(" ")
    path = path.replace("{name}", "absent.csv")
    if method == "WEBSOCKET":
        return _handshake(made, path, {"Host": made.host, **headers})
    with made.http() as client:
        return client.request(method, path, headers=headers).status_code


def _handshake(made: Site, path: str, headers: dict[str, str]) -> int:
    """Return the answer to a WebSocket's begin; a library would not send any Host."""
    sent = {
        **headers,
        "Upgrade": "websocket",
        "Connection": "Upgrade",
        "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
        "Sec-WebSocket-Version": "13",
    }
    lines = [f"GET {path} HTTP/1.1", *(f"{name}: {value}" for name, value in sent.items()), "", ""]
    name, _, port = made.host.rpartition(":")
    with socket.create_connection((name, int(port)), timeout=LIMIT) as connection:
        connection.sendall("\r\n".join(lines).encode())
        line = connection.makefile("rb").readline()
    return int(line.split()[1])


def test_each_route_has_its_row(left: Site) -> None:
    assert sorted(routes(left)) == sorted(EXPECTED | PAGE)


def test_a_route_answers_each_credential_as_expected(own: Site) -> None:
    for route, expected in EXPECTED.items():
        with entry(route):
            assert status(own, route, {}) == expected.anonymous
            assert status(own, route, own.bearer(Scope.VIEW)) == expected.viewer
            assert status(own, route, own.bearer(Scope.OPERATE)) == expected.operator
            assert status(own, route, own.bearer("0" * 32)) == 401
            assert status(own, route, {"Authorization": "Basic dmlldzp2aWV3"}) == 401


def test_an_expired_cookie_is_as_none(own: Site) -> None:
    for route in sorted(EXPECTED.keys() - {"POST /session"}):
        with entry(route), own.signed_in(Scope.ADMIN) as browser:
            cookie = own.cookie(browser)
            for session in own.gateway.sessions._sessions.values():
                session.until -= LIFETIME
            assert status(own, route, cookie) == status(own, route, {"Origin": own.origin})


@pytest.mark.parametrize("place", FOREIGN)
def test_a_request_from_elsewhere_is_refused_by_each_route(place: str, left: Site) -> None:
    headers, refused = FOREIGN[place]
    port = left.host.rpartition(":")[2]
    sent = {name: value.format(host=left.host, port=port) for name, value in headers.items()}
    for route in EXPECTED:
        with entry(route):
            assert status(left, route, {**left.bearer(Scope.ADMIN), **sent}) == refused


@pytest.mark.parametrize("path", ["/absent", "/api/absent", "/docs", "/page/index.html"])
def test_a_path_without_a_route_needs_a_token_too(path: str, left: Site) -> None:
    assert status(left, f"GET {path}", {}) == 401
    assert status(left, f"GET {path}", left.bearer(Scope.VIEW)) == 404


def test_every_answer_has_the_headers_that_protect_it(left: Site) -> None:
    with left.http() as client:
        answers: list[httpx.Response] = [
            client.get("/"),
            client.get("/api/state"),
            client.get("/", headers={"Host": "evil.example"}),
            client.get("/absent", headers=left.bearer(Scope.VIEW)),
            client.post("/api/stop", headers=left.bearer(Scope.VIEW)),
        ]
    for answer in answers:
        policy = answer.headers["content-security-policy"]
        assert policy.startswith("default-src 'self';")
        assert "frame-ancestors 'none'" in policy
        assert "unsafe" not in policy
        assert answer.headers["x-content-type-options"] == "nosniff"
        kept = answer.request.url.path == "/" and answer.status_code == 200
        assert answer.headers["cache-control"] == ("no-cache" if kept else "no-store")
        assert answer.headers["cross-origin-resource-policy"] == "same-origin"
        assert "access-control-allow-origin" not in answer.headers
        assert "server" not in answer.headers


def test_the_page_loads_nothing_that_its_policy_forbids(left: Site) -> None:
    with left.http() as client:
        texts = {
            path: client.get(path).text
            for path in ASSETS
            if path.endswith(("/", ".html", ".js")) and not path.startswith("/vendor/")
        }
    for path, text in texts.items():
        for forbidden in ("innerHTML", "outerHTML", "document.write", "eval(", "new Function"):
            assert forbidden not in text, path
        if path.endswith(".js"):
            continue
        for forbidden in ("://", "data:", "<script>", "onclick=", "style="):
            assert forbidden not in text, path
        for loaded in re.findall(r'(?:src|href)="([^"#]+)"', text):
            assert f"/{loaded}" in ASSETS, loaded


def test_openapi_describes_each_route_and_the_messages(left: Site) -> None:
    with left.http(headers=left.bearer(Scope.VIEW)) as client:
        document: dict[str, Any] = client.get("/openapi.json").json()
    described = {
        f"{method.upper()} {path}"
        for path, methods in document["paths"].items()
        for method in methods
    }
    assert described == set(EXPECTED) - set(PAGE) - {"GET /openapi.json", "WEBSOCKET /ws"}
    schemas = document["components"]["schemas"]
    assert {"StateSample", "FromClient", "FromOwner", "SignIn"} <= set(schemas)
    unknown = {"type": ["number", "null"]}
    assert schemas["StateSample"]["properties"]["positions"]["items"] == unknown
    assert schemas["AcquireLease"]["properties"]["time_to_live"]["type"] == "number"
    for reference in _references(document):
        assert reference.removeprefix("#/components/schemas/") in schemas, reference


def _references(value: Any) -> Iterator[str]:
    match value:
        case {"$ref": str(reference)}:
            yield reference
        case dict():
            for each in value.values():
                yield from _references(each)
        case list():
            for each in value:
                yield from _references(each)
