"""The way to an owner through the gateway of its arm, which ``bioscara web`` runs."""

from __future__ import annotations

import hashlib
import ipaddress
import os
import re
import socket
import ssl
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from bioscara.api import framing
from bioscara.arguments import shown
from bioscara.errors import (
    AccessError,
    ConfigurationError,
    InvalidArgumentError,
    OwnerLostError,
)
from bioscara.extras import install, require
from bioscara.printing import printable

if TYPE_CHECKING:
    from bioscara.remote.websocket import WebSocketConnection

TOKEN_VARIABLE = "BIOSCARA_TOKEN"  # noqa: S105  the name of the variable
"""Environment variable with the token, unless one is given."""
_HOST = re.compile(r"[0-9A-Za-z._:%-]{1,253}")
_TOKEN = re.compile(r"[!-~]{1,256}")
_DIGEST = re.compile(r"[0-9a-f]{64}")
_USER_TIMEOUT = 5000
"""Time after which the system ends a connection whose other end confirms nothing [ms]."""
_IDLE, _INTERVAL, _PROBES = 5, 1, 5
"""Silence after which the system asks whether the other end is there, period [s], and how often."""


class GatewayAddress:
    """The way to an owner through its gateway; a ``Transport``.

    Args:
        url: Address of the gateway, ``https://HOST:PORT``, or ``http://127.0.0.1:PORT`` on its own
            computer.
        token: One of its tokens; None for that of the environment variable ``BIOSCARA_TOKEN``.
        ca_file: Certificates of the authorities that are trusted, as PEM; None for the system's.
        fingerprint: SHA-256 fingerprint of the gateway's certificate, which is trusted in place of
            authorities, as ``bioscara web`` prints it; None for authorities.

    Raises:
        InvalidArgumentError: The address, the token or the fingerprint is none.
        ConfigurationError: The file of the authorities cannot be used.
        NotSupportedError: A package is missing.
    """

    pause, silence = 0.05, 5.0
    direct_stop = None
    """None: the gateway has one to its owner."""

    def __init__(
        self,
        url: str,
        token: str | None = None,
        *,
        ca_file: Path | str | None = None,
        fingerprint: str | None = None,
    ) -> None:
        self.name, self._host, self._port, tls = _parts(url)
        self._token = _usable_token(self.name, token)
        self._fingerprint = None if fingerprint is None else _digest(fingerprint)
        if not tls and (ca_file, fingerprint) != (None, None):
            raise InvalidArgumentError(
                f"{self.name} has no certificate to be checked; leave out ca_file and fingerprint, "
                "or give the address as https://"
            )
        if ca_file is not None and fingerprint is not None:
            raise InvalidArgumentError(
                "ca_file and fingerprint exclude one another; leave out one of them"
            )
        require("websockets", f"{self.name}: a connection to a gateway", install("web"))
        self._tls = _context(ca_file, pinned=fingerprint is not None) if tls else None

    def __str__(self) -> str:
        return self.name

    def encoded(self, message: object) -> bytes:
        """Return a message as JSON."""
        return framing.encode_json(message)

    def connect(self, patience: float) -> WebSocketConnection:
        """Connect; arguments and errors as of a ``Transport``."""
        # Most programs connect to no gateway.
        from bioscara.remote.websocket import WebSocketConnection  # noqa: PLC0415

        connection = self._connected(patience)
        try:
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            # The loss of the network is noticed as soon as that of an owner.
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, _USER_TIMEOUT)
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPIDLE, _IDLE)
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPINTVL, _INTERVAL)
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPCNT, _PROBES)
            if self._tls is not None:
                connection = self._secured(connection, self._tls)
            made = WebSocketConnection(connection, self.name, patience)
            made.shake_hands(self._token)
        except TimeoutError as error:
            connection.close()
            raise OwnerLostError(f"{self.name} has not answered within {patience:g} s") from error
        except BaseException:
            connection.close()
            raise
        return made

    def ended(self) -> bool:
        """Return false: a gateway that is not reached says nothing about its owner."""
        return False

    def _connected(self, patience: float) -> socket.socket:
        """Return a connection to the first address of the host that answers."""
        try:
            # Resolved once: the address that is checked is the one that is used.
            found = socket.getaddrinfo(self._host, self._port, type=socket.SOCK_STREAM)
        except (OSError, UnicodeError) as error:
            raise OwnerLostError(
                f"{self.name}: {self._host} has no address: {getattr(error, 'strerror', error)}"
            ) from error
        addresses = list(dict.fromkeys(str(each[4][0]) for each in found))
        for address in addresses:
            if self._tls is None and not ipaddress.ip_address(address).is_loopback:
                raise InvalidArgumentError(
                    f"{self.name} is another computer, and the token would be readable on the "
                    "network: give the address as https://, and start the gateway with TLS; "
                    "nothing was sent"
                )
        failed: OSError = OSError("it has no address")
        for address in addresses:
            try:
                # Directly: a proxy of the environment would see which arm is used, or miss it.
                return socket.create_connection((address, self._port), timeout=patience)
            except OSError as error:
                failed = error
        reason = "no answer" if isinstance(failed, TimeoutError) else failed.strerror or failed
        raise OwnerLostError(
            f"no gateway answers at {self.name}: {reason}; 'bioscara web' starts one"
        ) from failed

    def _secured(self, connection: socket.socket, context: ssl.SSLContext) -> ssl.SSLSocket:
        """Return the connection with TLS, whose other end has the certificate that it has to."""
        try:
            secured = context.wrap_socket(connection, server_hostname=self._host)
        except ssl.SSLCertVerificationError as error:
            raise AccessError(
                f"the certificate of {self.name} is not trusted: {error.verify_message}. Compare "
                "its fingerprint with the one that 'bioscara web' printed and give that as "
                "fingerprint, or its authority as ca_file; the token was not sent"
            ) from error
        except ssl.SSLError as error:
            raise OwnerLostError(
                f"{self.name} does not begin TLS ({error.reason or error}); a gateway of this "
                "computer without it has an address with http://"
            ) from error
        except ConnectionError as error:
            raise OwnerLostError(f"{self.name} ended the connection: {error.strerror}") from error
        if self._fingerprint is not None:
            found = hashlib.sha256(secured.getpeercert(binary_form=True) or b"").hexdigest()
            if found != self._fingerprint:
                secured.close()
                raise AccessError(
                    f"the certificate of {self.name} has the fingerprint {_shown(found)}, and not "
                    f"{_shown(self._fingerprint)}: another computer may answer in its place, or it "
                    "has a new certificate; the token was not sent"
                )
        return secured


def is_address(name: str) -> bool:
    """Return whether the name of an arm is the address of a gateway."""
    return name.startswith(("http:", "https:"))


def _parts(url: str) -> tuple[str, str, int, bool]:
    """Return the address in its usual form, its host, its port and whether it has TLS.

    Raises:
        InvalidArgumentError: It is no address of a gateway.
    """
    try:
        parts = urlsplit(url)
        host, port = parts.hostname, parts.port
    except (ValueError, AttributeError):
        parts, host, port = urlsplit(""), None, None
    if parts.fragment:
        # Not shown: it may be the token, as in the address that is printed for browsers.
        raise InvalidArgumentError(
            "the address of a gateway ends before '#': leave out the token, and give it apart"
        )
    wrong = parts.username is not None or parts.query or parts.path not in {"", "/"}
    if parts.scheme not in {"http", "https"} or not _HOST.fullmatch(host or "") or wrong:
        raise InvalidArgumentError(
            f"{printable(str(url))!r} is no address of a gateway; give https://HOST:PORT"
        )
    tls = parts.scheme == "https"
    assert host is not None  # noqa: S101  it has matched
    port = port or (443 if tls else 80)
    shown = f"[{host}]" if ":" in host else host
    return f"{parts.scheme}://{shown}:{port}", host, port, tls


def _usable_token(name: str, given: str | None) -> str:
    token = os.environ.get(TOKEN_VARIABLE, "") if given is None else given
    if not token:
        raise InvalidArgumentError(
            f"{name} needs a token, as token or in the environment variable {TOKEN_VARIABLE}; "
            "'bioscara web' names the file that has them"
        )
    # Not shown: it is a secret.
    if not isinstance(token, str) or not _TOKEN.fullmatch(token):
        raise InvalidArgumentError(
            "the token is none: it has 1 to 256 visible ASCII characters, without spaces"
        )
    return token


def _digest(fingerprint: str) -> str:
    digest = str(fingerprint).replace(":", "").lower()
    if not _DIGEST.fullmatch(digest):
        raise InvalidArgumentError(
            f"the fingerprint {printable(str(fingerprint))!r} is no SHA-256 fingerprint: it has 64 "
            "hexadecimal digits, as 'bioscara web --tls-self-signed' prints them"
        )
    return digest


def _shown(digest: str) -> str:
    return bytes.fromhex(digest).hex(":").upper()


def _context(ca_file: Path | str | None, *, pinned: bool) -> ssl.SSLContext:
    if not (ca_file is None or isinstance(ca_file, str | Path)):
        raise InvalidArgumentError(f"ca_file is {shown(ca_file)}; give the path of a file")
    try:
        context = ssl.create_default_context(cafile=ca_file)
    except ValueError as error:
        raise ConfigurationError(
            f"ca_file {printable(str(ca_file))} is no path of a file"
        ) from error
    except OSError as error:  # an ssl.SSLError also
        raise ConfigurationError(
            f"{ca_file} has no certificates as PEM: {error.strerror or error}"
        ) from error
    if pinned:
        # Its certificate is compared in place of this.
        context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    return context
