"""Which names and addresses a gateway answers to.

A site in a browser can let its own name resolve to the address of a gateway (DNS rebinding), and
can send requests to it. Hence each request must name the gateway as its Host, and as its Origin.
"""

from __future__ import annotations

import ipaddress
import re
import socket
from collections.abc import Iterable

from bioscara.errors import ConfigurationError
from bioscara.printing import printable

LOCAL_NAMES = ("localhost", "127.0.0.1", "::1")
"""Names of this computer, from this computer."""
_NAME = re.compile(r"(?=.{1,253}$)[a-z0-9]([a-z0-9_-]{0,62})(\.[a-z0-9]([a-z0-9_-]{0,62}))*")


def require_host_name(text: str) -> str:
    """Return a name or address of a computer, in lower case, an address in its usual form.

    Raises:
        ConfigurationError: It is none.
    """
    name = text.lower().removeprefix("[").removesuffix("]")
    try:
        return str(ipaddress.ip_address(name))
    except ValueError:
        if _NAME.fullmatch(name):
            return name
    raise ConfigurationError(
        f"{printable(text)!r} is no name of a computer: give one as arm.example, or an address, "
        "without a port"
    )


def is_loopback(host: str) -> bool:
    """Return whether only this computer can reach a host that is listened on.

    Raises:
        ConfigurationError: The name does not resolve.
    """
    try:
        found = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)
    except OSError as error:
        raise ConfigurationError(
            f"{printable(host)} has no address ({error.strerror}); give an address of this computer"
        ) from error
    return all(ipaddress.ip_address(address[4][0]).is_loopback for address in found)


def is_any(host: str) -> bool:
    """Return whether a host that is listened on means all addresses of this computer."""
    try:
        return ipaddress.ip_address(host).is_unspecified
    except ValueError:
        return False


class OwnAddresses:
    """The values of Host and Origin that name a gateway.

    Args:
        names: Names and addresses of the gateway's computer.
        port: TCP port.
        tls: Whether it speaks TLS.
    """

    def __init__(self, names: Iterable[str], port: int, *, tls: bool) -> None:
        usual = 443 if tls else 80
        hosts = set()
        for name in names:
            host = f"[{name}]" if ":" in name else name
            hosts.add(f"{host}:{port}")
            if port == usual:
                hosts.add(host)
        self.hosts = frozenset(hosts)
        scheme = "https" if tls else "http"
        self.origins = frozenset(f"{scheme}://{host}" for host in hosts)

    def is_host(self, values: list[str]) -> bool:
        """Return whether the values of Host headers name the gateway; there must be one."""
        return len(values) == 1 and values[0].lower() in self.hosts

    def is_origin(self, values: list[str]) -> bool:
        """Return whether the values of Origin headers name the gateway; there must be one."""
        return len(values) == 1 and values[0].lower() in self.origins
