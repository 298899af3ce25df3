"""Where a gateway listens, and with which certificate."""

from __future__ import annotations

import asyncio
import json
import re
import socket
import ssl
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from cryptography import x509
from websockets.asyncio.client import connect

from bioscara.api import runtime
from bioscara.errors import AccessError, ConfigurationError, OwnerLostError
from bioscara.robot.tasks.scope import Scope
from bioscara.web import gateway as gateway_module, protocols
from bioscara.web.access.certificates import fingerprint, self_signed
from bioscara.web.gateway import Gateway, GatewaySettings
from entries import entry
from web.gateways import Site, WebClientOfTest, arm, running_gateway


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with arm("tls", tmp_path_factory.mktemp("faults")):
        yield "tls"


@pytest.fixture
def local(served: str) -> Iterator[None]:
    """No certificate and no tokens are left of another test."""
    yield
    for path in runtime.folder().glob(f"{served}.*"):
        if path.suffix in {".crt", ".key", ".tokens"}:
            path.unlink()


@pytest.mark.usefixtures("local")
@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.0.2.7"])
def test_beyond_this_computer_it_does_not_begin_without_tls(host: str, served: str) -> None:
    with pytest.raises(ConfigurationError, match=r"reachable from other computers.*--tls-cert"):
        Gateway(GatewaySettings(served, host=host, port=0))
    assert not (runtime.folder() / f"{served}.tokens").exists()


@pytest.mark.usefixtures("local")
@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"host": "0.0.0.0", "self_signed": True}, "--allowed-host"),
        ({"host": "192.0.2.7", "self_signed": True}, "cannot be listened on"),
        ({"host": "absent.invalid"}, "has no address"),
        ({"host": "a b"}, "no name of a computer"),
        ({"allowed_hosts": ["http://a"]}, "no name of a computer"),
        ({"certificate": Path("/absent.crt"), "key": Path("/absent.key")}, "/absent.crt"),
    ],
)
def test_unusable_options_of_the_gateway_are_refused(
    options: dict[str, Any], text: str, served: str
) -> None:
    with pytest.raises(ConfigurationError, match=re.escape(text)):
        Gateway(GatewaySettings(served, **{"port": 0, **options}))


@pytest.mark.usefixtures("local")
def test_beyond_this_computer_it_does_not_begin_with_known_tokens(served: str) -> None:
    path = runtime.folder() / f"{served}.tokens"
    path.write_text("{}")
    path.chmod(0o644)
    with pytest.raises(AccessError, match="others may use it"):
        Gateway(GatewaySettings(served, "0.0.0.0", 0, ["arm.example"], self_signed=True))


def test_without_an_owner_it_does_not_begin() -> None:
    with pytest.raises(OwnerLostError, match="no owner of arm absent runs"):
        Gateway(GatewaySettings("absent", port=0))


@pytest.mark.usefixtures("local")
def test_a_port_in_use_is_refused(served: str) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        with pytest.raises(ConfigurationError, match=f"port {port} cannot be listened on"):
            Gateway(GatewaySettings(served, port=port))


@pytest.mark.usefixtures("local")
def test_a_connection_that_asks_for_nothing_is_ended(
    served: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(gateway_module, "HEAD_TIMEOUT", 0.2)
    gateway = Gateway(GatewaySettings(served, port=0))
    headers = {"Authorization": f"Bearer {gateway.tokens.of(Scope.VIEW)}"}
    with running_gateway(gateway):
        made = Site(gateway, None, runtime.folder())
        address = "127.0.0.1", int(made.host.rpartition(":")[2])
        with (
            made.websocket(headers) as connection,
            socket.create_connection(address, timeout=5.0) as silent,
            socket.create_connection(address, timeout=5.0) as slow,
        ):
            client = WebClientOfTest(connection)
            client.greet()
            slow.sendall(b"GET / HTTP/1.1\r\nHost: ")
            assert silent.recv(1) == b""
            assert slow.recv(1) == b""
            # One that has become a WebSocket stays.
            assert client.request("get_lease")["kind"] == "lease_state"


@pytest.mark.usefixtures("local")
def test_a_request_that_does_not_end_is_ended_in_each_of_its_shapes(
    served: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(gateway_module, "HEAD_TIMEOUT", 0.4)
    monkeypatch.setattr(protocols, "HEAD_TIMEOUT", 0.4)
    monkeypatch.setattr(protocols, "BODY_TIMEOUT", 0.4)
    plain = Gateway(GatewaySettings(served, port=0))
    secure = Gateway(GatewaySettings(served, port=0, self_signed=True))
    with running_gateway(plain), running_gateway(secure):
        host = f"Host: {plain.url[7:-1]}\r\n"
        whole = f"GET /healthz HTTP/1.1\r\n{host}"
        shapes = {
            "silent": (plain, ""),
            "slow head": (plain, whole),
            "slow body": (plain, f"{whole}Content-Length: 99\r\n\r\n"),
            "half a second request": (plain, f"{whole}\r\n{whole}"),
            "slow handshake": (secure, "\x16\x03\x01\x02\x00"),
        }
        for shape, (gateway, sent) in shapes.items():
            address = "127.0.0.1", int(gateway.url.rpartition(":")[2].rstrip("/"))
            with entry(shape), socket.create_connection(address, timeout=5.0) as slow:
                slow.sendall(sent.encode("latin-1"))
                begin = time.monotonic()
                # A byte now and then is no progress.
                while time.monotonic() < begin + 4.0:
                    try:
                        slow.sendall(b"x")
                        slow.settimeout(0.1)
                        while slow.recv(4096):
                            pass
                        break
                    except TimeoutError:
                        continue
                    except OSError:
                        break
                assert time.monotonic() - begin < 3.0


async def greeted(address: str, trusting: ssl.SSLContext, headers: dict[str, str]) -> str:
    """Return the kind of the answer to a greeting.

    In one thread: a socket with TLS that one thread reads while another one writes can lose data
    (issue 77271 of CPython).
    """
    async with connect(address, ssl=trusting, additional_headers=headers) as connection:
        hello = {"kind": "hello", "version": 1, "client": "test", "session": "tls"}
        await connection.send(json.dumps(hello))
        kind: str = json.loads(await connection.recv())["kind"]
        return kind


@pytest.mark.usefixtures("local")
def test_it_speaks_tls_with_a_certificate_of_its_own(served: str, tmp_path: Path) -> None:
    gateway = Gateway(GatewaySettings(served, port=0, self_signed=True))
    key, certificate = (runtime.folder() / f"{served}.{end}" for end in ("key", "crt"))
    assert key.stat().st_mode & 0o777 == 0o600
    assert gateway.fingerprint == fingerprint(certificate)
    assert re.fullmatch("([0-9A-F]{2}:){31}[0-9A-F]{2}", gateway.fingerprint)
    trusting = ssl.create_default_context(cafile=str(certificate))
    with running_gateway(gateway):
        made = Site(gateway, None, tmp_path)
        assert made.origin.startswith("https://127.0.0.1:")
        with made.http(verify=trusting, headers={"Origin": made.origin}) as client:
            answer = client.post("/session", json={"token": gateway.tokens.of(Scope.VIEW)})
            assert answer.status_code == 200
            cookie = answer.headers["set-cookie"]
            assert cookie.startswith("__Host-bioscara-tls=")
            assert "; Secure" in cookie
            assert client.get("/api/state").status_code == 200
            plain = {"Origin": made.origin.replace("https", "http")}
            assert client.get("/healthz", headers=plain).status_code == 403
            address = made.origin.replace("https", "wss") + "/ws"
            assert asyncio.run(greeted(address, trusting, made.cookie(client))) == "welcome"
        port = int(made.host.rpartition(":")[2])
        with socket.create_connection(("127.0.0.1", port), timeout=10.0) as unencrypted:
            unencrypted.sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n")
            assert not unencrypted.recv(100).startswith(b"HTTP")
    again = Gateway(GatewaySettings(served, port=0, self_signed=True))
    assert again.fingerprint == gateway.fingerprint
    again.close()


@pytest.mark.usefixtures("local")
def test_it_takes_a_certificate_that_is_given_and_no_other_key(served: str, tmp_path: Path) -> None:
    certificate, key = tmp_path / "given.crt", tmp_path / "given.key"
    self_signed(certificate, key, ("localhost", "::1"))
    settings = GatewaySettings(served, "::1", 0, certificate=certificate, key=key)
    gateway = Gateway(settings)
    trusting = ssl.create_default_context(cafile=str(certificate))
    with running_gateway(gateway):
        assert re.fullmatch(r"https://\[::1\]:\d+/", gateway.url)
        made = Site(gateway, None, tmp_path)
        with made.http(verify=trusting) as client:
            assert client.get("/healthz").status_code == 200
    other = tmp_path / "other.key"
    self_signed(tmp_path / "other.crt", other, ("localhost",))
    with pytest.raises(ConfigurationError, match="cannot be used for TLS"):
        Gateway(GatewaySettings(served, "::1", 0, certificate=certificate, key=other))
    with pytest.raises(ConfigurationError, match="has no certificate"):
        Gateway(GatewaySettings(served, "::1", 0, certificate=key, key=key))


def test_a_certificate_is_kept_until_it_does_not_suit(tmp_path: Path) -> None:
    certificate, key = tmp_path / "a.crt", tmp_path / "a.key"

    def made(*names: str) -> str:
        self_signed(certificate, key, names)
        return fingerprint(certificate)

    first = made("localhost", "127.0.0.1")
    assert made("localhost", "127.0.0.1") == first
    found = x509.load_pem_x509_certificate(certificate.read_bytes())
    lifetime = found.not_valid_after_utc - found.not_valid_before_utc
    assert 365 <= lifetime.days <= 366
    names = found.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    assert names.get_values_for_type(x509.DNSName) == ["localhost"]
    assert [str(each) for each in names.get_values_for_type(x509.IPAddress)] == ["127.0.0.1"]
    second = made("localhost", "arm.example")
    assert second != first
    certificate.write_text("no certificate")
    assert made("localhost", "arm.example") != second
    key.unlink()
    third = made("localhost", "arm.example")
    key.chmod(0o644)
    with pytest.raises(AccessError, match="others may use it"):
        made("localhost", "arm.example")
    key.unlink()
    assert made("localhost", "arm.example") != third
    assert key.stat().st_mode & 0o777 == 0o600
    with pytest.raises(ConfigurationError, match="No such file"):
        self_signed(tmp_path / "absent" / "a.crt", tmp_path / "absent" / "a.key", ("a",))
