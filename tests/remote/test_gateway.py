"""A program that reaches an arm through its gateway: trust, refusals, and broken connections.

Its motions and questions are in test_robot_contract.py.
"""

from __future__ import annotations

import os
import re
import signal
import socket
import ssl
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from http.server import HTTPServer, SimpleHTTPRequestHandler
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bioscara import Robot
from bioscara.api import messages as m
from bioscara.errors import (
    AccessError,
    BioscaraError,
    InvalidArgumentError,
    LeaseError,
    MotionCancelledError,
    NotSupportedError,
    OwnerError,
    OwnerLostError,
    ProtocolError,
)
from bioscara.planning import Trajectory
from bioscara.remote import (
    GatewayAddress,
    link as link_module,
    websocket as websocket_module,
)
from bioscara.remote.link import OwnerLink
from bioscara.robot.tasks.scope import Scope
from bioscara.server.serve import Served
from bioscara.web.access.certificates import fingerprint, self_signed
from bioscara.web.access.tokens import default_path, load_tokens
from bioscara.web.gateway import Gateway, GatewaySettings
from bioscara.web.routes import websocket as route
from cli.said import Said
from programs import environment
from remote.cutting_proxy import DOWN, UP, Proxy
from served import HALF, NAME, arm_served, eventually
from simulated import NAMES
from web.gateways import running_gateway

Start = Callable[..., subprocess.Popen[str]]
LONG = (0.9, 0.15, 0.2, 0.7)
WRONG = "0123456789abcdef" * 2


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    with arm_served(speed=20.0) as made:
        yield made


@pytest.fixture(scope="module")
def gateway(served: Served) -> Iterator[Gateway]:
    assert served.robot.is_homed
    with running_gateway(Gateway(GatewaySettings(NAME, port=0))) as made:
        yield made


def connect(gateway: Gateway, scope: Scope = Scope.OPERATE, **options: Any) -> Any:
    return Robot.connect(gateway.url, token=gateway.tokens.of(scope), **options)


def port_of(gateway: Gateway) -> int:
    return int(gateway.url.rstrip("/").rpartition(":")[2])


def started(start: Start, *words: str) -> tuple[subprocess.Popen[str], str, str]:
    """Start ``bioscara web``; return it with its address and its fingerprint."""
    command = ("-m", "bioscara", "web", "--arm", NAME, *words)
    process = start(*command, env=environment())
    assert process.stdout is not None
    address = re.search(r"on the web: (\S+)", process.stdout.readline())
    assert address is not None
    process.stdout.readline()
    printed = process.stdout.readline() if "--tls-self-signed" in words else ""
    return process, address[1], printed.rpartition(" ")[2].strip()


def token(scope: Scope = Scope.OPERATE) -> str:
    return load_tokens(default_path(NAME)).of(scope)


@contextmanager
def tls_server(folder: Path) -> Iterator[tuple[str, str, list[bytes]]]:
    """Serve TLS with a certificate of its own; yield address, fingerprint, and all that comes."""
    certificate, key = folder / "other.crt", folder / "other.key"
    self_signed(certificate, key, ["localhost", "127.0.0.1"])
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(certificate, key)
    received: list[bytes] = []
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def serve() -> None:
            with suppress(OSError):
                while True:
                    plain, _ = listener.accept()
                    with suppress(OSError), context.wrap_socket(plain, server_side=True) as end:
                        end.settimeout(0.5)
                        received.append(b"")
                        while data := end.recv(1 << 16):
                            received.append(data)

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        yield f"https://127.0.0.1:{listener.getsockname()[1]}", fingerprint(certificate), received
        listener.shutdown(socket.SHUT_RDWR)
    thread.join(5.0)


def test_a_real_gateway_is_reached_by_its_fingerprint_and_by_its_own_authority(
    served: Served, start: Start
) -> None:
    _, url, printed = started(start, "--port", "0", "--tls-self-signed")
    assert url.startswith("https://")
    with Robot.connect(url, token=token(), fingerprint=printed) as robot:
        height = robot.pose.z
        robot.move_relative(z=0.002)
        assert robot.pose.z == pytest.approx(height + 0.002, abs=5e-4)
    own = default_path(NAME).with_suffix(".crt")
    with Robot.connect(url, token=token(), ca_file=own) as robot:
        assert robot.state.names == NAMES
    with pytest.raises(AccessError, match=r"not trusted: self.signed.*'bioscara web' printed"):
        Robot.connect(url, token=token()).open()


def test_a_gateway_with_another_certificate_gets_no_token(tmp_path: Path) -> None:
    with tls_server(tmp_path) as (url, theirs, received):
        wrong = "00:" * 31 + "00"
        accesses: tuple[dict[str, Any], ...] = ({"fingerprint": wrong}, {})
        for access in accesses:
            with pytest.raises(AccessError, match="the token was not sent"):
                Robot.connect(url, token=WRONG, **access).open()
        assert WRONG.encode() not in b"".join(received)
        # The same server gets it where the fingerprint is its own.
        with pytest.raises(OwnerError):
            Robot.connect(url, token=WRONG, fingerprint=theirs.lower()).open()
        eventually(lambda: WRONG.encode() in b"".join(received))


def test_without_tls_no_other_computer_is_connected_to(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(socket, "create_connection", lambda *_, **__: pytest.fail("connected"))
    for host in ("192.0.2.1", "[2001:db8::1]"):
        with pytest.raises(
            InvalidArgumentError, match=r"readable on the network.*nothing was sent"
        ):
            Robot.connect(f"http://{host}:8080", token=WRONG).open()


@pytest.mark.parametrize(
    ("url", "access", "text"),
    [
        ("https://a@pi:8080", {}, "no address of a gateway"),
        ("https://pi:8080/ws", {}, "no address of a gateway"),
        ("https://pi:99999", {}, "no address of a gateway"),
        ("https://", {}, "no address of a gateway"),
        ("https://pi:8080/#token=abc", {}, "ends before '#'"),
        ("https://pi:8080", {"token": ""}, "needs a token.*BIOSCARA_TOKEN"),
        ("https://pi:8080", {"token": "two words"}, "visible ASCII"),
        ("https://pi:8080", {"fingerprint": "12:34"}, "64 hexadecimal digits"),
        ("https://pi:8080", {"fingerprint": "0" * 64, "ca_file": "a"}, "exclude one another"),
        ("http://127.0.0.1:1", {"fingerprint": "0" * 64}, "has no certificate"),
        ("https://pi:8080", {"ca_file": "/absent"}, "/absent has no certificates"),
        ("https://pi:8080", {"ca_file": 3}, "give the path of a file"),
        ("https://pi:8080", {"ca_file": "\0"}, "no path of a file"),
        ("https://a b:8080", {}, "no address of a gateway"),
        ("https://pi:8080", {"rate": 50}, "its owner has"),
        ("arm:left", {"fingerprint": "0" * 64}, "token is for the address of a gateway"),
        ("sim", {}, "token is for the address of a gateway"),
    ],
)
def test_unusable_addresses_and_credentials_are_refused_and_not_shown(
    url: str, access: dict[str, Any], text: str
) -> None:
    with pytest.raises(InvalidArgumentError, match=text) as refused:
        Robot.connect(url, **{"token": WRONG, **access})
    assert WRONG not in str(refused.value)


def test_a_missing_package_is_named_with_its_installation(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bioscara.extras.find_spec", lambda _: None)
    with pytest.raises(NotSupportedError, match=r"needs websockets.*pip install 'bioscara\[web\]'"):
        Robot.connect("https://pi:8080", token=WRONG)


def test_refusals_of_a_gateway_say_why(gateway: Gateway, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(AccessError, match="the token is not one of this gateway"):
        Robot.connect(gateway.url, token=WRONG).open()
    with connect(gateway, Scope.VIEW) as robot:
        assert robot.is_homed
        with pytest.raises(AccessError, match="needs the scope operate"):
            robot.home()
        robot.stop()
    listener = socket.create_server(("127.0.0.1", 0))
    other = f"http://127.0.0.1:{listener.getsockname()[1]}"
    with (
        closing(Proxy(listener, socket.AF_INET, ("127.0.0.1", port_of(gateway)))),
        pytest.raises(AccessError, match="the Host is no name of this gateway"),
    ):
        Robot.connect(other, token=WRONG).open()
    with pytest.raises(OwnerLostError, match=r"does not begin TLS.*http://"):
        Robot.connect(gateway.url.replace("http", "https"), token=WRONG).open()
    monkeypatch.setattr(link_module, "m", SimpleNamespace(**{**vars(m), "VERSION": 99}))
    with pytest.raises(ProtocolError, match="99"):
        connect(gateway).open()
    monkeypatch.undo()
    monkeypatch.setattr(route, "WEBSOCKETS", 0)
    with pytest.raises(OwnerLostError, match="there are 0 clients; try again later"):
        connect(gateway).open()


def test_what_is_no_gateway_is_called_so(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(link_module, "PATIENCE", 0.3)
    monkeypatch.setattr(SimpleHTTPRequestHandler, "log_message", lambda *_: None)
    monkeypatch.setattr(SimpleHTTPRequestHandler, "protocol_version", "HTTP/1.1")
    with HTTPServer(("127.0.0.1", 0), SimpleHTTPRequestHandler) as server:
        threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
        with pytest.raises(ProtocolError, match=r"no gateway of an arm.*status 404"):
            Robot.connect(f"http://127.0.0.1:{server.server_port}", token=WRONG).open()
        server.shutdown()
    with socket.create_server(("127.0.0.1", 0)) as silent:
        url = f"http://127.0.0.1:{silent.getsockname()[1]}"
        with pytest.raises(OwnerLostError, match=r"has not answered within 0\.3 s"):
            Robot.connect(url, token=WRONG).open()
    with pytest.raises(OwnerLostError, match=r"no gateway answers.*'bioscara web' starts one"):
        Robot.connect(url, token=WRONG).open()
    with pytest.raises(OwnerLostError, match=r"absent\.invalid has no address"):
        Robot.connect("https://absent.invalid", token=WRONG).open()


def test_a_proxy_of_the_environment_is_not_used(
    gateway: Gateway, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("http_proxy", "https_proxy", "all_proxy", "ws_proxy"):
        monkeypatch.setenv(name, "http://127.0.0.1:1")
    monkeypatch.setenv("BIOSCARA_TOKEN", gateway.tokens.of(Scope.VIEW))
    with Robot.connect(gateway.url) as robot:
        assert robot.is_homed


def test_no_rate_of_calls_breaks_the_limits_of_a_gateway(gateway: Gateway) -> None:
    failed: list[BaseException] = []
    with connect(gateway, Scope.VIEW) as robot:
        first = robot._link._connection

        def ask() -> None:
            try:
                for _ in range(75):
                    assert robot.is_homed
            except BaseException as error:  # noqa: BLE001  reported by the test
                failed.append(error)

        threads = [threading.Thread(target=ask) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert failed == []
        assert robot._link._connection is first
        # So much waits now that others would be sent after 10 s.
        first._left = -1000.0
        begin = time.monotonic()
        robot.stop()
        assert time.monotonic() - begin < 2.0


def test_a_long_trajectory_is_uploaded_in_parts_that_fit(gateway: Gateway) -> None:
    count = 3000
    ramp = np.linspace(0.0, 1.0, count)[:, None]
    rows = np.array(HALF) + ramp * (np.array((0.31, 0.2003, 0.81, -0.51)) - np.array(HALF))
    step = (rows[1] - rows[0]) / 0.01
    moving = np.vstack([np.zeros(4), np.tile(step, (count - 2, 1)), np.zeros(4)])
    # Each number has as many digits as a number can have.
    digits = np.full((count, 4), -1.2345678901234567e-13)
    times = np.arange(count) * 0.01
    trajectory = Trajectory(NAMES, times, rows + digits, moving + digits, digits)
    with connect(gateway) as robot:
        robot.move_joints(HALF)
        robot.follow(trajectory)
        assert robot.state.positions == pytest.approx(rows[-1], abs=2e-3)
        robot.move_joints(HALF)


@pytest.mark.parametrize("direction", [UP, DOWN])
def test_a_goal_is_carried_out_once_wherever_the_network_breaks(
    served: Served, direction: str
) -> None:
    # The proxy has the port of the gateway, which answers to its own names alone.
    listener = socket.create_server(("127.0.0.1", 0))
    port = listener.getsockname()[1]
    made = Gateway(GatewaySettings(NAME, host="127.0.0.2", port=port))
    with (
        running_gateway(made),
        closing(Proxy(listener, socket.AF_INET, ("127.0.0.2", port))) as proxy,
        Robot.connect(f"http://127.0.0.1:{port}", token=token()) as robot,
    ):
        robot.move_relative(z=0.002)
        before = proxy.passed[direction]
        robot.move_relative(z=-0.002)
        size = proxy.passed[direction] - before
        sign = 1.0
        for count in range(0, size, max(size // 8, 1)):
            goals, height = served.owner.goals.last, robot.pose.z
            proxy.cut_after(direction, count)
            robot.move_relative(z=sign * 0.002)
            assert served.owner.goals.last == goals + 1, f"cut after {count} bytes"
            assert robot.pose.z - height == pytest.approx(sign * 0.002, abs=5e-4)
            sign = -sign


def test_a_short_break_of_the_network_keeps_the_motion_and_a_longer_one_ends_it() -> None:
    # The proxy has the port of the gateway, which answers to its own names alone.
    listener = socket.create_server(("127.0.0.1", 0))
    port = listener.getsockname()[1]
    with (
        arm_served(speed=1.0) as served,
        running_gateway(Gateway(GatewaySettings(NAME, host="127.0.0.2", port=port))),
        closing(Proxy(listener, socket.AF_INET, ("127.0.0.2", port))) as proxy,
        Robot.connect(f"http://127.0.0.1:{port}", token=token()) as connected,
    ):
        robot: Any = connected
        robot.speed_override = 0.1
        operation = robot.move_joints(LONG, wait=False)
        eventually(lambda: robot.is_moving)
        epoch = served.owner.lease.epoch
        for _ in range(3):
            proxy.cut()
            # Longer than a program may be away.
            time.sleep(0.5)
            assert served.owner.goals.running
        assert served.owner.lease.epoch == epoch
        proxy.accepting = False
        begin = time.monotonic()
        proxy.cut()
        eventually(lambda: not served.owner.goals.running, what="the motion ends")
        # The lease of a silent program ends after 2 s.
        assert time.monotonic() - begin < 1.5
        proxy.accepting = True
        with pytest.raises((MotionCancelledError, LeaseError)):
            operation.result(20.0)
        with pytest.raises(LeaseError, match="acquire_lease"):
            robot.move_joints(HALF)
        robot.acquire_lease()
        robot.speed_override = 1.0
        robot.move_relative(z=0.002)


def test_a_gateway_that_is_killed_stops_the_motion_and_is_found_again(start: Start) -> None:
    with arm_served(speed=1.0) as served:
        process, url, _ = started(start, "--port", "0")
        remote: Any = Robot.connect(url, token=token())
        with remote as robot:
            robot.speed_override = 0.1
            operation = robot.move_joints(LONG, wait=False)
            eventually(lambda: robot.is_moving)
            os.killpg(process.pid, signal.SIGKILL)
            port = url.rstrip("/").rpartition(":")[2]
            started(start, "--port", port)
            # Its end has reached the owner: as of any program that is killed, the motion ends.
            with pytest.raises((MotionCancelledError, LeaseError)):
                operation.result(20.0)
            assert not robot.is_moving
            with pytest.raises(LeaseError, match="acquire_lease"):
                robot.move_joints(HALF)
            robot.acquire_lease()
            robot.speed_override = 1.0
            robot.move_relative(z=0.002)
            assert served.owner.goals.last == 2


def test_a_gateway_that_is_gone_is_reported_in_time(
    served: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert served.robot.is_homed
    monkeypatch.setattr(link_module, "PATIENCE", 0.3)
    with running_gateway(Gateway(GatewaySettings(NAME, port=0))) as made:
        robot: Any = connect(made)
        robot.open()
    for call in (lambda: robot.state, robot.home, robot.stop):
        with pytest.raises(OwnerLostError, match="no gateway answers"):
            call()
    robot.close()


def test_a_connection_that_is_refused_while_it_lasts_is_not_tried_again(gateway: Gateway) -> None:
    lost: list[BaseException] = []
    way = GatewayAddress(gateway.url, gateway.tokens.of(Scope.VIEW))
    with closing(OwnerLink(way, lambda _: None, lost.append)) as link:
        link.open()
        # A gateway refuses a second hello with code 1008.
        hello = m.ClientHello(version=m.VERSION, client="again", session="again")
        link._write(way.encoded(hello))
        eventually(lambda: lost)
        assert "hello came twice" in str(lost[0])
        assert isinstance(link.request(m.GetState()), m.StateSample)


def test_commands_reach_an_arm_through_its_gateway(
    served: Served, gateway: Gateway, tmp_path: Path, capsys: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    say = Said(capsys)
    assert served.robot.is_homed
    url = gateway.url.rstrip("/")
    file = tmp_path / "token"
    file.write_text(f"{gateway.tokens.of(Scope.OPERATE)}\n")
    access = f"--arm {url} --token-file {file}"
    assert "others may use the token" in say.refusal(f"status {access}")
    file.chmod(0o600)
    assert say.output(f"status {access}").startswith(f"arm: {url}, ")
    assert say(f"move --joints 0.31 0.2 0.8 -0.5 {access}").status == 0
    assert say.output(f"stop {url} --token-file {file}") == f"{url} was stopped\n"
    assert "is paused" in say.output(f"pause {access}")
    monkeypatch.setenv("BIOSCARA_ARM", url)
    assert "needs a token" in say.refusal("status")
    monkeypatch.setenv("BIOSCARA_TOKEN", gateway.tokens.of(Scope.OPERATE))
    assert "continues" in say.output("resume")
    file.write_text("two words")
    assert "has not one token" in say.refusal(f"status {access}")
    monkeypatch.delenv("BIOSCARA_ARM")
    assert "leave it out" in say.refusal(f"status --arm {NAME} --token-file {file}")
    assert "no name of an arm" in say.refusal(f"web --arm {url}")


def test_the_library_writes_no_token_into_a_log(
    gateway: Gateway, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("DEBUG")
    with connect(gateway) as robot:
        assert robot.is_homed
    assert gateway.tokens.of(Scope.OPERATE) not in caplog.text
    assert websocket_module._RATE <= 100.0
    assert not issubclass(BioscaraError, OSError)
