"""The WebSocket: the messages that it passes, and its ends."""

from __future__ import annotations

import json
import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed

from bioscara.api import framing, messages as m
from bioscara.robot.tasks.scope import Scope
from bioscara.server.clients import connection
from bioscara.web import protocols
from bioscara.web.gateway import Gateway, GatewaySettings
from bioscara.web.owner import relay
from bioscara.web.routes import websocket
from programs import wait_until
from served import events_since
from web.gateways import Site, WebClientOfTest, arm, running_gateway, site

HOME = {"kind": "home"}


@pytest.fixture
def own() -> Iterator[Site]:
    with site("own") as made:
        yield made


def test_a_viewer_looks_plans_pauses_and_stops_and_does_no_more(left: Site) -> None:
    with left.client(Scope.VIEW) as viewer:
        assert viewer.request("get_state")["names"] == ["j1", "j2", "j3", "j4"]
        assert viewer.request("get_description")["name"] == "left"
        assert viewer.request("list_goals")["goals"] == []
        planned = viewer.request("make_plan", motion={"kind": "unfold"})
        assert planned["error"] == "NotHomedError"
        assert viewer.request("pause") == {"kind": "done"}
        assert viewer.request("stop") == {"kind": "done"}
        for kind, fields in (
            ("acquire_lease", {}),
            ("start", {"task": HOME}),
            ("resume", {}),
            ("set_speed_override", {"share": 0.5}),
            ("set_parameters", {"overlay": "", "revision": 1}),
        ):
            refused = viewer.request(kind, epoch=1, **fields)
            assert refused["error"] == "AccessError", kind
            assert "this client has view" in refused["text"]


def test_a_pause_of_a_viewer_is_lifted_by_the_holder_of_the_lease_alone(left: Site) -> None:
    with left.client(Scope.VIEW) as viewer, left.client(Scope.OPERATE) as operator:
        assert viewer.request("pause", may_resume=True) == {"kind": "done"}
        (name,) = operator.request("get_state")["paused_by"]
        assert name.startswith("test (view, ")
        refused = operator.request("resume")
        assert refused["error"] == "LeaseError"
        assert refused["text"] == f"paused by '{name}'; the client that takes the lease can resume"
        epoch = operator.request("acquire_lease")["lease"]["epoch"]
        assert operator.request("resume") == {"kind": "done"}
        assert operator.request("get_state")["paused_by"] == []
        operator.request("release_lease", epoch)


def test_an_operator_lifts_its_own_pause_without_the_lease(left: Site) -> None:
    with left.client(Scope.OPERATE) as operator, left.client(Scope.OPERATE, "other") as other:
        epoch = other.request("acquire_lease")["lease"]["epoch"]
        assert operator.request("pause") == {"kind": "done"}
        assert operator.request("resume") == {"kind": "done"}
        assert operator.request("get_state")["paused"] is False
        other.request("release_lease", epoch)


def test_an_operator_commands_and_does_not_administer(left: Site) -> None:
    with left.client(Scope.OPERATE) as operator:
        epoch = operator.request("acquire_lease")["lease"]["epoch"]
        assert operator.request("set_speed_override", epoch, share=0.5) == {"kind": "done"}
        for kind, fields in (
            ("acquire_lease", {"force": True}),
            ("set_parameters", {"overlay": "", "revision": 1}),
            ("set_hardware_state", {"component": "a", "state": "b"}),
            ("switch_controllers", {}),
        ):
            refused = operator.request(kind, epoch, **fields)
            assert (refused["error"], "admin" in refused["text"]) == ("AccessError", True), kind
        assert operator.request("release_lease", epoch) == {"kind": "done"}


def test_an_administrator_takes_the_lease_from_another(left: Site) -> None:
    with left.client(Scope.OPERATE) as operator, left.client(Scope.ADMIN) as admin:
        epoch = operator.request("acquire_lease")["lease"]["epoch"]
        assert admin.request("acquire_lease")["error"] == "LeaseError"
        taken = admin.request("acquire_lease", force=True)["lease"]
        assert taken["client"] == "test (admin, 127.0.0.1)"
        assert operator.request("set_speed_override", epoch, share=1.0)["error"] == "LeaseError"
        admin.request("release_lease", taken["epoch"])


def test_a_stop_of_a_viewer_ends_the_lease_of_the_one_who_commands(left: Site) -> None:
    with left.client(Scope.OPERATE) as operator, left.client(Scope.VIEW, "guest") as viewer:
        operator.request("acquire_lease", time_to_live=60.0)
        operator.request("subscribe", events_after=operator.welcome["last_event"])
        viewer.request("stop")
        event = operator.receive(lambda message: message.get("what") == "stop")
        assert event["client"] == "guest (view, 127.0.0.1)"
        assert viewer.request("get_lease")["lease"]["client"] is None


def test_a_second_websocket_of_a_session_renews_its_lease(left: Site) -> None:
    with left.signed_in(Scope.OPERATE) as browser, ExitStack() as stack:
        page, worker = (
            WebClientOfTest(stack.enter_context(left.websocket(left.cookie(browser))))
            for _ in range(2)
        )
        page.greet(session="page")
        epoch = page.request("acquire_lease", time_to_live=0.8)["lease"]["epoch"]
        worker.greet(session="page")
        # Both number their requests on their own.
        for number in range(3):
            page.request("get_lease")
            time.sleep(0.5)
            assert worker.request("renew_lease", epoch)["kind"] == "lease_state", number
        # The session goes on without it.
        worker.socket.close()
        assert page.request("renew_lease", epoch)["kind"] == "lease_state"
        page.request("release_lease", epoch)
        assert left.served is not None
        events = events_since(left.served, page.welcome["last_event"])
        come = [event.text for event in events if event.what == "client"]
        assert come == ["test (operate, 127.0.0.1) has connected"]


def test_a_stop_by_post_and_by_socket_are_those_of_one_client(left: Site) -> None:
    with (
        left.signed_in(Scope.OPERATE) as browser,
        left.signed_in(Scope.OPERATE) as another,
        left.websocket(left.cookie(browser)) as connection,
    ):
        page = WebClientOfTest(connection)
        page.greet(session="page")
        epoch = page.request("acquire_lease", time_to_live=60.0)["lease"]["epoch"]
        of_page = {"Bioscara-Session": "page"}
        page.request("stop")
        for _ in range(2):
            assert browser.post("/api/stop", headers=of_page).status_code == 200
        assert page.request("get_lease")["lease"]["epoch"] == epoch
        assert page.request("renew_lease", epoch)["kind"] == "lease_state"
        # Another browser, or a program, does not become the same client by the name of its session.
        for number, headers in enumerate(({}, left.bearer(Scope.OPERATE))):
            epoch = page.request("acquire_lease", time_to_live=60.0)["lease"]["epoch"]
            sent = another.post("/api/stop", headers={**of_page, **headers})
            assert sent.status_code == 200, number
            assert page.request("get_lease")["lease"]["client"] is None
        # Names that cannot be used hinder no STOP.
        for name in ("", "x" * 1000):
            headers = {"Bioscara-Session": name}
            assert browser.post("/api/stop", headers=headers).status_code == 200
        assert left.served is not None
        events = events_since(left.served, page.welcome["last_event"])
    stops = [event.text for event in events if event.what == "stop"]
    ended = [text for text in stops if "ended the lease" in text]
    assert len(ended) == 2
    # The page's socket and POST, then those that cannot be told to be of the page.
    assert stops[0].startswith("test (operate")
    assert len(stops) == 1 + 2 + 2, stops


@pytest.mark.parametrize(
    ("given", "shown"),
    [
        ("bob", "bob (view, 127.0.0.1)"),
        ("a\x1b[2J\nb", "a\\x1b[2J\\nb (view, 127.0.0.1)"),
        ("root (admin, ::1)", "root (admin, ::1) (view, 127.0.0.1)"),
        ("x" * m.NAME_MAX, "x" * 46 + " (view, 127.0.0.1)"),
    ],
)
def test_the_owner_gets_the_name_and_scope_of_a_client(given: str, shown: str, left: Site) -> None:
    with left.client(Scope.VIEW) as watching:
        watching.request("subscribe", events_after=watching.welcome["last_event"])
        with left.client(Scope.VIEW, given):
            event = watching.receive(lambda message: shown == message.get("client"))
            assert len(event["client"]) <= m.NAME_MAX


def test_a_client_does_not_get_the_session_of_one_with_a_better_token(left: Site) -> None:
    with (
        left.websocket(left.bearer(Scope.OPERATE)) as first,
        left.websocket(left.bearer(Scope.VIEW)) as second,
        left.websocket(left.bearer(Scope.OPERATE)) as third,
    ):
        operator, viewer, again = map(WebClientOfTest, (first, second, third))
        for client in (operator, viewer, again):
            client.greet(session="known")
        epoch = operator.request("acquire_lease")["lease"]["epoch"]
        assert viewer.request("recall", request=1)["kind"] == "not_arrived"
        again.send({"kind": "request", "id": 9, "command": {"kind": "recall", "request": 1}})
        answer = again.receive(lambda message: message.get("id") == 9)
        assert answer["result"]["lease"]["epoch"] == epoch
        operator.request("release_lease", epoch)


@pytest.mark.parametrize(
    ("sent", "code"),
    [
        ("{", 1007),
        ("[" * 100_000, 1007),
        ('{"kind":"hello","version":1,"client":"\\ud800","session":"a"}', 1007),
        ('{"kind":"nothing"}', 1007),
        ("null", 1007),
        ("", 1007),
        (b"\x81\xa4kind\xa5hello", 1003),
        ('{"kind":"request","id":1,"command":{"kind":"stop"}}', 1008),
        (' {"kind":"request","id":1,"command":{"kind":"acquire_lease"}}', 1008),
    ],
)
def test_bytes_that_are_no_message_end_the_connection(
    sent: str | bytes, code: int, left: Site
) -> None:
    with left.websocket(left.bearer(Scope.ADMIN)) as connection:
        connection.send(sent)
        found, reason = WebClientOfTest(connection).closed()
    assert (found, bool(reason)) == (code, True)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"version": 2}, "the owner speaks version 1 of its messages, not 2"),
        ({"client": "a" * 65}, "a client and its session have names of 1 to 64 characters"),
        ({"session": ""}, "a client and its session have names of 1 to 64 characters"),
    ],
)
@pytest.mark.parametrize("more", ["", '{"kind":"request","id":1,"command":{"kind":"get_state"}}'])
def test_a_client_whose_hello_the_owner_refuses_does_not_connect_again(
    changes: dict[str, object], reason: str, more: str, left: Site
) -> None:
    hello = {"kind": "hello", "version": 1, "client": "test", "session": "s", **changes}
    with left.websocket(left.bearer(Scope.VIEW)) as refused:
        refused.send(json.dumps(hello))
        if more:
            with suppress(ConnectionClosed):
                refused.send(more)
        code, said = WebClientOfTest(refused).closed()
    assert code == 1008
    assert said.startswith(reason)


def test_a_second_hello_and_none_end_the_connection_for_good(
    left: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    with left.client(Scope.VIEW) as client:
        client.send({"kind": "hello", "version": 1, "client": "test", "session": "s"})
        assert client.closed() == (1008, "hello came twice")
    monkeypatch.setattr(connection, "HELLO_TIMEOUT", 0.2)
    with left.websocket(left.bearer(Scope.VIEW)) as silent:
        assert WebClientOfTest(silent).closed() == (
            1008,
            "the connection ended before a hello came",
        )


@pytest.mark.parametrize(
    "command",
    [
        '{"kind":"stop","kind":"acquire_lease"}',
        '{"kind":"acquire_lease","kind":"stop"}',
        r'{"\u006bind":"acquire_lease"}',
        r'{"kind":"acquire\u005flease"}',
        '{"kind":"acquire_lease"},"command":{"kind":"get_lease"}',
        '{"kind":"get_lease"},"command":{"kind":"acquire_lease"}',
        '{"kind":"get_lease"},"kind":"request","command":{"kind":"acquire_lease"}',
    ],
)
def test_no_spelling_of_a_command_passes_the_filter(command: str, left: Site) -> None:
    with left.client(Scope.VIEW) as viewer, left.client(Scope.VIEW) as other:
        viewer.socket.send(f' {{"kind":"request","id":5,"command":{command}}}')
        answer = viewer.receive(lambda message: message.get("id") == 5)
        assert "failure" in answer or answer["result"]["kind"] in {"done", "lease_state"}
        assert other.request("get_lease")["lease"]["client"] is None


def test_a_wrong_request_is_refused_and_the_next_one_carried_out(left: Site) -> None:
    with left.client(Scope.VIEW) as client:
        refused = client.request("get_state", surplus=1)
        assert refused["error"] == "InvalidArgumentError"
        assert "surplus" in refused["text"]
        assert client.request("get_lease")["kind"] == "lease_state"


def test_a_long_message_arrives_and_one_that_is_too_long_ends_it(own: Site) -> None:
    points = 2000
    trajectory: dict[str, Any] = {
        "joint_names": ["j1", "j2", "j3", "j4"],
        "times": [0.01 * index for index in range(points)],
        "positions": [[0.1234567890123456] * 4] * points,
    }
    task = {"kind": "follow", "trajectory": trajectory}
    assert framing.REQUEST_MAX // 2 < len(json.dumps(task)) < framing.REQUEST_MAX
    with own.client(Scope.OPERATE) as client:
        epoch = client.request("acquire_lease")["lease"]["epoch"]
        answer = client.request("start", epoch, task=task)
        assert answer.get("error") in {"NotHomedError", "TrajectoryError"}, answer
        with suppress(ConnectionClosed):
            client.socket.send("x" * (framing.REQUEST_MAX + 1))
        # 1006: the rest of the message arrived after the end, and the reason was lost.
        assert client.closed()[0] in {1009, 1006}
    with own.client(Scope.VIEW) as other:
        assert other.request("get_state")["kind"] == "state"


def test_who_floods_is_cut_off_and_others_are_not(own: Site) -> None:
    request = {"kind": "request", "id": 1, "command": {"kind": "get_lease"}}
    with own.client(Scope.VIEW) as other, own.client(Scope.VIEW) as flooding:
        text = json.dumps(request)
        with suppress(ConnectionClosed):
            for _ in range(100 * protocols.VIEWER_MESSAGES):
                flooding.socket.send(text)
        assert flooding.closed() in {(1008, "more than 100 messages in a second"), (1006, "")}
        assert other.request("get_state")["kind"] == "state"


def test_a_viewer_that_floods_keeps_out_no_other_of_its_address(own: Site) -> None:
    with own.client(Scope.VIEW) as busy, own.client(Scope.VIEW) as other:
        # Nearly all that they may send together.
        for _ in range(protocols.VIEWER_MESSAGES + protocols.VIEWER_SHARE - 10):
            busy.socket.ping()
        for _ in range(protocols.VIEWER_SHARE - 5):
            other.send({"kind": "request", "id": 99, "command": {"kind": "get_lease"}})
        assert other.request("stop") == {"kind": "done"}
    with own.websocket(own.bearer(Scope.VIEW)) as connection:
        flooding = WebClientOfTest(connection)
        flooding.greet()
        with suppress(ConnectionClosed):
            for _ in range(4 * protocols.VIEWER_MESSAGES):
                connection.ping()
        begin = time.monotonic()
        for _ in range(10):
            with own.client(Scope.VIEW) as other:
                assert other.request("get_state")["kind"] == "state"
        assert time.monotonic() - begin < protocols._FAREWELL
        assert flooding.closed()[0] == 1008


def test_a_slow_reader_gets_the_newest_sample_after_few_old_ones() -> None:
    # At 20 times the speed, 2000 samples of 1 kB a second.
    with site("fast", speed=20.0) as made:
        name, _, port = made.host.rpartition(":")
        slow = socket.socket()
        slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 8192)
        slow.connect((name, int(port)))
        with made.client(Scope.VIEW, sock=slow, max_queue=1, close_timeout=0.1) as client:
            client.request("subscribe", states=True)
            assert made.served is not None
            owner = made.served.owner
            begin = owner.sample.cycle
            wait_until(lambda: owner.sample.cycle > begin + 4000, "the arm goes on")
            newest, old = owner.sample.cycle, 0
            while client.receive(lambda message: message["kind"] == "state")["cycle"] < newest:
                old += 1
            assert old < 250
            assert client.request("get_lease")["kind"] == "lease_state"


def test_a_reader_that_takes_nothing_is_cut_off(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(relay, "SEND_TIMEOUT", 0.3)
    with site("fast", speed=20.0) as made:
        name, _, port = made.host.rpartition(":")
        deaf = socket.socket()
        deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        deaf.connect((name, int(port)))
        with (
            made.client(Scope.VIEW) as other,
            made.client(Scope.VIEW, "deaf", sock=deaf, max_queue=1, close_timeout=0.1) as client,
        ):
            other.request("subscribe", events_after=other.welcome["last_event"])
            client.request("subscribe", states=True)
            other.receive(lambda message: message.get("text") == "deaf (view, 127.0.0.1) has left")


def test_signing_out_and_expiry_end_the_connections_of_a_browser(own: Site) -> None:
    with own.signed_in(Scope.VIEW) as browser:
        with own.websocket(own.cookie(browser)) as connection:
            client = WebClientOfTest(connection)
            client.greet()
            assert browser.delete("/session").status_code == 200
            assert client.closed() == (1008, "signed out")
        assert browser.get("/api/state").status_code == 401
    with own.signed_in(Scope.VIEW) as browser:
        (session,) = own.gateway.sessions._sessions.values()
        session.until = time.monotonic() + 1.0
        with own.websocket(own.cookie(browser)) as connection:
            assert WebClientOfTest(connection).closed() == (1008, "the sign-in has expired")


def test_there_is_a_largest_number_of_connections(
    own: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(websocket, "WEBSOCKETS", 2)
    monkeypatch.setattr(websocket, "VIEWERS", 1)
    monkeypatch.setattr(websocket, "RESERVED", 2)
    with own.client(Scope.VIEW), own.client(Scope.OPERATE) as operator:
        for scope in (Scope.VIEW, Scope.ADMIN):
            with own.client(scope) as further:
                # It may stop the arm, and do nothing else.
                epoch = operator.request("acquire_lease", time_to_live=60.0)["lease"]["epoch"]
                assert further.request("stop") == {"kind": "done"}
                assert operator.request("get_lease")["lease"]["client"] is None, epoch
                further.send({"kind": "request", "id": 9, "command": {"kind": "get_lease"}})
                most = 1 if scope == Scope.VIEW else 2
                assert further.closed() == (1013, f"there are {most} clients; try again later")
        # The oldest makes room, and those that send nothing are closed.
        with ExitStack() as stack:
            waiting = [stack.enter_context(own.client(Scope.VIEW)) for _ in range(3)]
            assert waiting[0].closed()[0] == 1013
            assert waiting[2].request("stop") == {"kind": "done"}
        monkeypatch.setattr(relay, "STOP_TIMEOUT", 0.2)
        with own.client(Scope.VIEW) as silent:
            assert silent.closed()[0] == 1013


def test_the_end_of_the_owner_is_said_and_its_next_run_is_found(tmp_path: Path) -> None:
    with arm("brief", tmp_path):
        gateway = Gateway(GatewaySettings("brief", port=0))
    with running_gateway(gateway):
        made = Site(gateway, None, tmp_path)
        with made.http(headers=made.bearer(Scope.VIEW)) as http:
            assert http.get("/healthz").json() == {"gateway": True, "owner": False}
            assert http.get("/api/state").status_code == 503
            assert http.get("/api/state").json()["error"] == "OwnerLostError"
            with made.websocket(made.bearer(Scope.VIEW)) as early:
                code, reason = WebClientOfTest(early).closed()
                assert (code, "no owner of arm brief runs" in reason) == (1013, True)
            instances = set()
            for _ in range(2):
                with ExitStack() as stack:
                    with arm("brief", tmp_path):
                        connection = stack.enter_context(made.websocket(made.bearer(Scope.VIEW)))
                        client = WebClientOfTest(connection)
                        client.greet()
                        instances.add(client.welcome["instance"])
                        assert http.get("/api/state").status_code == 200
                        assert http.get("/healthz").json() == {"gateway": True, "owner": True}
                    code, reason = client.closed()
                    assert (code, reason) == (1012, "the owner of arm brief has ended")
                assert http.get("/api/state").status_code == 503
            assert len(instances) == 2
