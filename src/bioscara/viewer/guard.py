"""Who may talk to the page: browsers that were sent to it, not pages of other sites in them.

Listening on the loopback address keeps other computers away, but not the pages of other sites in a
browser of this computer. A site can send requests to 127.0.0.1 and, by giving its own name that
address, read the answers. So every request, also the one that opens a WebSocket, must name this
page as its Host, and as its Origin where it has one.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http import HTTPStatus
from typing import Any

import websockets.asyncio.server

from bioscara.errors import ConfigurationError

NAMES = ("127.0.0.1", "localhost")
"""Names of this computer that the page answers to."""


def is_own(hosts: list[str], origins: list[str], port: int) -> bool:
    """Return whether a request is meant for the page and comes from it or from no page at all.

    Args:
        hosts: The values of its Host headers; there must be one.
        origins: The values of its Origin headers; there may be one.
        port: Where the page is served.
    """
    own = [f"{name}:{port}" for name in NAMES]
    if len(hosts) != 1 or hosts[0].lower() not in own or len(origins) > 1:
        return False
    return all(origin.lower() in [f"http://{host}" for host in own] for origin in origins)


@contextmanager
def guarded() -> Iterator[None]:
    """Refuse foreign requests to the server that is started meanwhile.

    The server offers no hook for that, so the function that it serves with is replaced.

    Raises:
        ConfigurationError: The server was started in another way and would not be guarded.
    """
    module = websockets.asyncio.server
    original, served = module.serve, []

    def serve(
        *arguments: Any, process_request: Callable[..., Any] | None = None, **options: Any
    ) -> Any:
        async def check(connection: Any, request: Any) -> Any:
            headers, port = request.headers, connection.local_address[1]
            if not is_own(headers.get_all("Host"), headers.get_all("Origin"), port):
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
            "this version of viser serves in a way that cannot be guarded against other sites; "
            "install the one that bioscara was tested with: pip install 'bioscara[view]'"
        )
