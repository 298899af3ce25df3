"""One-shot calls: questions, flight records, stop."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any
from urllib.parse import quote

import httpx
import msgspec
import pytest

from bioscara.api import messages as m
from bioscara.files.regular_file import MCAP_BEGIN
from bioscara.robot.tasks.scope import Scope
from bioscara.web.routes.questions import QUESTIONS
from programs import wait_until
from web.gateways import Site, site


@pytest.mark.parametrize("path", QUESTIONS)
def test_an_answer_is_the_struct_of_the_owner(path: str, left: Site) -> None:
    with left.http(headers=left.bearer(Scope.VIEW)) as client:
        answer = client.get(path)
    assert answer.headers["content-type"] == "application/json"
    # Unknown numbers are null: the arm is not homed.
    known = answer.text.replace("[null,null,null,null]", "[0,0,0,0]")
    known = known.replace('"width":null', '"width":0')
    result: Any = msgspec.json.decode(known, type=QUESTIONS[path][1])
    assert type(result) is QUESTIONS[path][1]


NAMES = ("stall.mcap", "a b;'\"=.mcap", "a\x1b[2J\nb.mcap", "größe.mcap", "%2e%2e.mcap")
DATA = MCAP_BEGIN + bytes(range(256))


def test_flight_records_are_downloaded_by_the_names_of_the_list(left: Site) -> None:
    for name in NAMES:
        (left.evidence / name).write_bytes(DATA + name.encode())
    with left.http(headers=left.bearer(Scope.VIEW)) as client:
        listed = client.get("/api/flight-records").json()["names"]
        assert sorted(listed) == sorted(NAMES)
        for name in NAMES:
            answer = client.get("/api/flight-records/" + quote(name, safe=""))
            assert answer.content == DATA + name.encode()
            assert answer.headers["content-type"] == "application/octet-stream"
            expected = "attachment; filename*=UTF-8''" + quote(name, safe="")
            assert answer.headers["content-disposition"] == expected


@pytest.mark.parametrize(
    "name",
    [
        "..%2f..%2f..%2fetc%2fpasswd",
        "%2e%2e/%2e%2e/secret",
        "/etc/passwd",
        "%00",
        "secret",
        "link.mcap%00.txt",
        "a" * 5000,
    ],
)
def test_no_path_is_made_of_a_name(name: str, left: Site) -> None:
    (left.evidence / "secret").write_text("secret")
    with left.http(headers=left.bearer(Scope.VIEW)) as client:
        answer = client.get(httpx.URL(f"{left.origin}/api/flight-records/{name}"))
    assert answer.status_code == 404
    assert "root:" not in answer.text


def test_stop_says_who_stopped(left: Site) -> None:
    with left.client(Scope.OPERATE) as operator:
        operator.request("subscribe", events_after=operator.welcome["last_event"])
        with left.http(headers=left.bearer(Scope.VIEW)) as client:
            assert client.post("/api/stop").json() == {"kind": "done"}
        event = operator.receive(lambda message: message.get("what") == "stop")
        assert event["client"] == "stop (view, 127.0.0.1)"


def test_questions_at_once_get_each_their_answer_and_leave_no_connection() -> None:
    with site("many") as made, made.client(Scope.VIEW) as other:

        def ask(index: int) -> bool:
            path = ("/api/state", "/api/goals", "/api/faults")[index % 3]
            with made.http(headers=made.bearer((Scope.VIEW, Scope.ADMIN)[index % 2])) as client:
                kind = client.get(path).json()["kind"]
                client.post("/api/stop")
            return bool(kind == ("state", "goal_list", "fault_list")[index % 3])

        with ThreadPoolExecutor(8) as pool:
            assert all(pool.map(ask, range(32)))

        # This WebSocket, and one for all questions.
        wait_until(lambda: other.request("get_statistics")["clients"] == 2, "the others have left")


def test_a_path_of_the_page_is_no_file_name(left: Site) -> None:
    with left.http(headers=left.bearer(Scope.VIEW)) as client:
        for path in (
            "/page.py",
            "/%2e%2e/app.py",
            "/js%2f..%2ficon.svg",
            "/index.html",
            "/messages.d.ts",
        ):
            assert client.get(httpx.URL(left.origin + path)).status_code == 404
        assert (
            client.get("/js/main.js").content
            == (Path(__file__).parents[3] / "src/bioscara/dashboard/page/js/main.js").read_bytes()
        )


def test_the_messages_of_this_version_are_those_of_the_gateway() -> None:
    assert m.VERSION == 1, "connection.js says which version it speaks: change it there, too"


@pytest.mark.parametrize(
    ("method", "path", "status"),
    [("GET", "/api/nothing", 404), ("GET", "/" + "a" * 5000, 404), ("POST", "/api/state", 405)],
)
def test_a_request_without_a_route_is_answered_with_a_failure(
    method: str, path: str, status: int, left: Site
) -> None:
    with left.http(headers=left.bearer(Scope.VIEW)) as client:
        answer = client.request(method, path)
    assert answer.status_code == status
    assert answer.headers.get("allow") == ("GET" if status == 405 else None)
    failure = msgspec.json.decode(answer.content, type=m.FailureValue)
    assert "/openapi.json lists what the gateway answers" in failure.text
    assert len(answer.content) < 1000
