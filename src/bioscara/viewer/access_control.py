"""Access control of the page: direct requests are served, those of other sites' pages refused.

Listening on the loopback address excludes other computers, but not the pages of other sites in a
browser on this computer. A site can send requests to 127.0.0.1 and, by resolving its own name to
that address, read the answers. Therefore every request, also the one that opens a WebSocket, must
name this page as its Host, and as its Origin if it has one.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http import HTTPStatus
from typing import Any

import websockets.asyncio.server

from bioscara.errors import ConfigurationError
from bioscara.extras import install

NAMES = ("127.0.0.1", "localhost")
"""Host names of this computer that the page accepts."""


def is_own_request(hosts: list[str], origins: list[str], port: int) -> bool:
    """Return whether a request addresses the page and originates from it or from no page.

    Args:
        hosts: The values of its Host headers; there must be one.
        origins: The values of its Origin headers; there may be one.
        port: TCP port of the page.
    """
    own = [f"{name}:{port}" for name in NAMES]
    if len(hosts) != 1 or hosts[0].lower() not in own or len(origins) > 1:
        return False
    return all(origin.lower() in [f"http://{host}" for host in own] for origin in origins)


@contextmanager
def refusing_foreign_requests() -> Iterator[None]:
    """Refuse foreign requests to the server that is started within this context.

    The server offers no hook for that, so the function that it serves with is replaced.

    Raises:
        ConfigurationError: The server was started by another function and would not be guarded.
    """
    module = websockets.asyncio.server
    original, served = module.serve, []

    def serve(
        *arguments: Any, process_request: Callable[..., Any] | None = None, **options: Any
    ) -> Any:
        async def check(connection: Any, request: Any) -> Any:
            headers, port = request.headers, connection.local_address[1]
            if not is_own_request(headers.get_all("Host"), headers.get_all("Origin"), port):
                return connection.respond(
                    HTTPStatus.FORBIDDEN, "This page is for this computer only.\n"
                )
            answer = None if process_request is None else process_request(connection, request)
            return await answer if inspect.isawaitable(answer) else answer

        served.append(True)
        return original(*arguments, process_request=check, **options)

    module.serve = serve  # type: ignore[misc, assignment]
    try:
        yield
    finally:
        module.serve = original  # type: ignore[misc]
    if not served:
        raise ConfigurationError(
            "this version of viser starts its server in another manner and cannot be "
            "protected against other sites; install the one that bioscara was tested with: "
            f"{install('view')}"
        )
