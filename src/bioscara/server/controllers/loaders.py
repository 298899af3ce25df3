"""Which client has loaded each controller."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from bioscara.api import messages as m
from bioscara.errors import SwitchError
from bioscara.server.clients.client import Client


class Loaders:
    """The clients that have loaded controllers: each alone changes its own while it is connected.

    Args:
        announce: Adds an event, by its kind, text and client.
    """

    def __init__(self, announce: Callable[[m.EventKind, str, str], object]) -> None:
        self._announce = announce
        self._clients: dict[str, Client] = {}

    def former(self, client: Client, name: str) -> Client | None:
        """Return the client that has loaded a controller and has left; None if there is none.

        Raises:
            SwitchError: Another client has loaded it and is connected.
        """
        loader = self._clients.get(name)
        if loader is None or loader.session == client.session:
            return None
        if loader.connected:
            raise SwitchError(
                f"controller {name} is that of {loader.name}, which is connected; end that "
                "program, or load a controller of another name"
            )
        return loader

    def take(self, client: Client, names: Iterable[str]) -> None:
        """Let a client change controllers from now on: those of clients that have left, too.

        Raises:
            SwitchError: As :meth:`former`; then it has none of them.
        """
        formers = {name: self.former(client, name) for name in names}
        for name, former in formers.items():
            if former is not None:
                self.add(client, name, former)

    def add(self, client: Client, name: str, former: Client | None) -> None:
        """Note that a client has loaded a controller, in the place of one of ``former`` if any."""
        self._clients[name] = client
        if former is not None:
            text = f"{client.name} took controller {name} of {former.name}, which has left"
            self._announce("controllers", text, client.name)

    def remove(self, name: str) -> None:
        """Note that a controller was unloaded."""
        self._clients.pop(name, None)
