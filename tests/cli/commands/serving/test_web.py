"""``bioscara web`` from a terminal, and the arm after the gateway was killed."""

from __future__ import annotations

import json
import os
import pty
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from websockets.sync.client import connect

from bioscara.api import messages as m, runtime
from bioscara.remote.link import OwnerLink
from bioscara.robot.tasks.scope import Scope
from bioscara.server.serve import Served
from bioscara.web.access.tokens import default_path, load_tokens
from cli.said import Said
from programs import environment, wait_until
from web.gateways import WebClientOfTest, arm

Start = Callable[..., subprocess.Popen[str]]
NAME = "shell"


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    with arm(NAME, tmp_path_factory.mktemp("faults")) as made:
        yield made


def started(start: Start, *words: str) -> tuple[subprocess.Popen[str], str]:
    """Start a gateway; return it with its address."""
    process = start("-m", "bioscara", "web", "--port", "0", *words, env=environment())
    assert process.stdout is not None
    line = process.stdout.readline()
    found = re.search(r"on the web: (https?://127\.0\.0\.1:\d+/) \(Ctrl-C ends it\)\n$", line)
    assert found, line
    return process, found[1]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_serves_until_a_signal(number: signal.Signals, served: Served, start: Start) -> None:
    process, url = started(start)
    headers = {"Authorization": f"Bearer {load_tokens(default_path(NAME)).of(Scope.VIEW)}"}
    with connect(url.replace("http", "ws") + "ws", additional_headers=headers) as connection:
        client = WebClientOfTest(connection)
        client.greet()
        process.send_signal(number)
        assert client.closed()[0] == 1012
    assert process.wait(timeout=20) == 0
    assert process.stdout is not None
    rest = process.stdout.read()
    # Not a terminal, and so perhaps a log: no token is written.
    assert rest == f"its tokens are in {default_path(NAME)}: open the address with #token=...\n"


def test_a_terminal_gets_the_addresses_with_the_tokens(served: Served, start: Start) -> None:
    mine, its = pty.openpty()
    process = start(
        *("-m", "bioscara", "web", "--port", "0", "--tls-self-signed", "--arm", NAME),
        cold=True,
        env=environment(),
        stdout=its,
    )
    os.close(its)
    with os.fdopen(mine, encoding="utf-8", newline="") as terminal:
        text = "".join(terminal.readline() for _ in range(5))
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=20) == 0
    tokens = load_tokens(default_path(NAME))
    for scope in Scope:
        assert re.search(
            rf"to {scope.name.lower()} +https://127\.0\.0\.1:\d+/#token={tokens.of(scope)}\r", text
        )
    assert "fingerprint of its certificate: " in text


def test_serve_prints_one_address_on_a_terminal_that_of_operators(start: Start) -> None:
    mine, its = pty.openpty()
    words = ("serve", "--name", "alone", "--with", "web --port 0")
    process = start("-m", "bioscara", *words, env=environment(), stdout=its)
    os.close(its)
    text = ""
    with os.fdopen(mine, encoding="utf-8", newline="") as terminal:
        while re.search(r"token=\w", text) is None:
            text += terminal.readline()
        process.send_signal(signal.SIGINT)
        with suppress(OSError):  # the end of a terminal
            text += terminal.read()
    assert process.wait(timeout=20) == 0
    tokens = load_tokens(default_path("alone"))
    addresses = re.findall(r"http://127\.0\.0\.1:\d+/(\S*)", text)
    assert addresses == [f"#token={tokens.of(Scope.OPERATE)}"]


def test_an_arm_survives_the_death_of_its_gateway_and_the_lease_ends(
    served: Served, start: Start
) -> None:
    process, url = started(start)
    headers = {"Authorization": f"Bearer {load_tokens(default_path(NAME)).of(Scope.OPERATE)}"}
    received: list[m.FromOwner] = []
    link = OwnerLink(NAME, received.append, lambda _: None)
    link.open()
    try:
        with connect(url.replace("http", "ws") + "ws", additional_headers=headers) as connection:
            client = WebClientOfTest(connection)
            client.greet("hand")
            epoch = client.request("acquire_lease", time_to_live=60.0)["lease"]["epoch"]
            accepted = client.request("start", epoch, task={"kind": "home"})
            number = accepted["goal"]["goal"]
            begin = time.monotonic()
            process.kill()
            process.wait(20)
            assert client.closed()[0] == 1006

        def goal() -> m.GoalValue:
            answer = link.request(m.GetGoal(number))
            assert isinstance(answer, m.GoalState)
            return answer.goal

        wait_until(lambda: goal().done, "the goal of the lost client ends")
        assert goal().status == "cancelled"
        assert time.monotonic() - begin < 4.0
        lease = link.request(m.GetLease())
        assert isinstance(lease, m.LeaseState)
        assert lease.lease.client is None
        texts = [event.text for event in received if isinstance(event, m.Event)]
        assert "hand (operate, 127.0.0.1) has ended, and its lease with it" in texts
    finally:
        link.close()


def test_without_an_owner_it_does_not_begin(said: Said) -> None:
    assert "no owner of arm absent runs" in said.refusal("web --arm absent")


def test_without_its_packages_the_error_names_them(
    monkeypatch: pytest.MonkeyPatch, said: Said
) -> None:
    monkeypatch.setitem(sys.modules, "fastapi", None)
    error = said.refusal("web")
    assert "the web gateway needs fastapi" in error
    assert "pip install 'bioscara[web]'" in error


def test_beyond_this_computer_it_needs_tls(served: Served, said: Said) -> None:
    assert "--tls-self-signed" in said.refusal("web --host 0.0.0.0 --port 0")


def test_a_token_file_can_be_named(served: Served, tmp_path: Path, said: Said) -> None:
    path = tmp_path / "tokens"
    path.write_text(json.dumps({"view": "a" * 32}))
    path.chmod(0o644)
    assert f"{path} has mode 0644" in said.refusal("web --port 0 --token-file", str(path))
    assert runtime.owners()
