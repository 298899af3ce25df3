"""The exchange of a token for a cookie, and its line in the log."""

from __future__ import annotations

import http.cookies
import logging
from collections.abc import Iterator

import pytest
from websockets.exceptions import InvalidStatus

from bioscara.robot.tasks.scope import Scope
from bioscara.web.access.browser_sessions import IDLE, LIFETIME, MOST, BrowserSessions
from bioscara.web.access.guard import REQUESTS, SIGN_INS
from web.gateways import Site, WebClientOfTest, site


@pytest.fixture
def own() -> Iterator[Site]:
    with site("own") as made:
        yield made


def test_a_cookie_is_for_this_site_alone_and_not_for_scripts(own: Site) -> None:
    with own.signed_in(Scope.OPERATE) as browser:
        assert browser.get("/session").json()["scope"] == "operate"
        assert browser.get("/api/state").status_code == 200
        answer = browser.post("/session", json={"token": own.gateway.tokens.of(Scope.VIEW)})
        assert answer.json() == {"scope": "view", "lifetime": LIFETIME}
        (cookie,) = http.cookies.SimpleCookie(answer.headers["set-cookie"]).values()
        assert cookie.key == "bioscara-own"
        assert len(cookie.value) >= 43
        assert cookie["httponly"]
        assert cookie["samesite"] == "strict"
        assert cookie["path"] == "/"
        assert cookie["domain"] == ""
        assert cookie["max-age"] == "43200"
        assert browser.get("/session").json()["scope"] == "view"
        assert browser.delete("/session").json() == {"scope": None}
        assert browser.get("/session").json()["scope"] is None


def test_a_cookie_needs_an_origin_where_something_changes(own: Site) -> None:
    with own.signed_in(Scope.ADMIN) as browser:
        assert browser.post("/api/stop").status_code == 200
        del browser.headers["Origin"]
        assert browser.get("/api/state").status_code == 200
        assert browser.post("/api/stop").status_code == 403
        assert browser.delete("/session").status_code == 403
        for site_of in ("cross-site", "same-site"):
            refused = browser.get("/api/state", headers={"Sec-Fetch-Site": site_of})
            assert refused.status_code == 403
        assert browser.get("/", headers={"Sec-Fetch-Site": "cross-site"}).status_code == 200


def test_a_websocket_takes_the_cookie_with_an_origin(own: Site) -> None:
    with own.signed_in(Scope.VIEW) as browser, own.websocket(own.cookie(browser)) as connection:
        client = WebClientOfTest(connection)
        client.greet()
        assert client.request("get_lease")["kind"] == "lease_state"


@pytest.mark.parametrize(
    ("content", "kind"),
    [
        (b"", "application/json"),
        (b"{", "application/json"),
        (b"null", "application/json"),
        (b'{"token":5}', "application/json"),
        (b'{"token":"\\ud800"}', "application/json"),
        (b'{"token":"0", "more":1}', "application/json"),
        (b"\xff", "application/json"),
        (b"[" * 1000, "application/json"),
        (b"x" * 5_000_000, "application/json"),
        (b"token=0", "application/x-www-form-urlencoded"),
        (b'{"token":"TOKEN"}', "text/plain"),
    ],
)
def test_other_bodies_do_not_sign_in(content: bytes, kind: str, own: Site) -> None:
    body = content.replace(b"TOKEN", own.gateway.tokens.of(Scope.VIEW).encode())
    with own.http(headers={"Origin": own.origin, "Content-Type": kind}) as client:
        answer = client.post("/session", content=body)
        assert answer.status_code == 401
        assert "set-cookie" not in answer.headers


def test_few_tokens_can_be_tried(own: Site) -> None:
    with own.http(headers={"Origin": own.origin}) as client:
        found = [
            client.post("/session", json={"token": "0" * 32}).status_code for _ in range(SIGN_INS)
        ]
        assert found == [401] * SIGN_INS
        assert client.post("/session", json={"token": "0" * 32}).status_code == 429
        assert client.get("/api/state", headers=own.bearer("0" * 32)).status_code == 429
        # The right token is not hindered by clients that guess, as a bearer and at a sign-in, also
        # where they use up all requests of the address.
        assert client.get("/api/state", headers=own.bearer(Scope.VIEW)).status_code == 200
        assert {client.get("/healthz").status_code for _ in range(3 * REQUESTS)} == {200, 429}
        right = {"token": own.gateway.tokens.of(Scope.VIEW)}
        assert client.post("/session", json=right).status_code == 200


def test_a_new_sign_in_ends_the_former_session_of_the_browser(own: Site) -> None:
    with own.signed_in(Scope.OPERATE) as browser:
        former = own.cookie(browser)
        with own.websocket(former) as connection:
            client = WebClientOfTest(connection)
            client.greet()
            token = {"token": own.gateway.tokens.of(Scope.VIEW)}
            assert browser.post("/session", json={"token": "0" * 32}).status_code == 401
            assert client.request("get_lease")["kind"] == "lease_state"
            assert browser.post("/session", json=token).status_code == 200
            assert client.closed() == (1008, "signed out")
        with own.http(headers=former) as other:
            assert other.get("/api/state").status_code == 401
        assert browser.get("/session").json()["scope"] == "view"


def test_few_requests_a_second_are_taken_from_each(own: Site) -> None:
    with own.http() as client, own.signed_in(Scope.VIEW) as browser:
        found = [client.get("/healthz").status_code for _ in range(3 * REQUESTS)]
        assert set(found) == {200, 429}
        assert browser.get("/session").status_code == 200
        # The page has more files than that, and STOP has no limit.
        assert {client.get("/css/base.css").status_code for _ in range(3 * REQUESTS)} == {200}
        found = [browser.get("/api/state").status_code for _ in range(3 * REQUESTS)]
        assert set(found) == {200, 429}
        assert browser.post("/api/stop").status_code == 200


def test_browsers_expire_and_the_oldest_is_signed_out() -> None:
    now = 0
    sessions = BrowserSessions(lambda: float(now))
    value = sessions.begin(Scope.VIEW)
    session = sessions.find(value)
    assert session is not None
    for now in range(0, int(LIFETIME), int(IDLE) - 1):  # noqa: B007  read by the clock
        assert sessions.find(value) is session
    for _ in range(MOST):
        sessions.begin(Scope.ADMIN)
    assert sessions.find(value) is session  # Others of another scope do not matter.
    for _ in range(MOST - 1):
        sessions.begin(Scope.VIEW)
    assert not session.ended.is_set()
    sessions.begin(Scope.VIEW)
    assert session.ended.is_set()
    assert sessions.find(value) is None
    assert len(sessions._sessions) == 2 * MOST
    latest = sessions.begin(Scope.ADMIN)
    now += int(IDLE)
    assert sessions.find(latest) is None


def test_secrets_are_not_logged(own: Site, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.DEBUG)
    with own.signed_in(Scope.VIEW) as browser:
        (value,) = browser.cookies.values()
        with own.websocket(own.cookie(browser)) as connection:
            WebClientOfTest(connection).greet()
        with own.client(Scope.ADMIN) as client:
            client.request("get_log")
        guess = "f" * 32
        browser.post("/session", json={"token": guess})
        browser.get("/api/state", headers=own.bearer(guess))
        with pytest.raises(InvalidStatus), own.websocket(own.bearer(guess)):
            pass
        browser.get(f"/api/absent?token={own.gateway.tokens.of(Scope.VIEW)}")
    written = "\n".join(
        record.getMessage() for record in caplog.records if record.threadName == "gateway"
    )
    assert written.splitlines() == ["a sign-in from 127.0.0.1 was refused"]
    for secret in (value, guess, *(own.gateway.tokens.of(scope) for scope in Scope)):
        assert secret not in written
