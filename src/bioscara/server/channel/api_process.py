"""The process that answers the clients of an owner: nothing in it moves the arm."""

from __future__ import annotations

import asyncio
import logging
import os
import resource
import socket
import sys
from contextlib import suppress

from bioscara.printing import printable
from bioscara.processes import nursery
from bioscara.processes.scheduling import name_process, wake_on_time
from bioscara.server.channel import channel_messages as c
from bioscara.server.channel.owner_proxy import OwnerProxy
from bioscara.server.clients.api_server import ApiServer
from bioscara.server.log_limit import LogLimit

MODULES = (__name__,)
"""Modules that the processes of an owner import before they fork."""
LISTENER, NURSERY = b"l", b"n"
"""Kinds of handed over files: a socket on which clients connect; the process from which others
fork."""
_SWITCH_INTERVAL = 0.0005
"""Time after which a thread that computes lets the loop of the clients go on [s]; usually 5 ms."""
_LAST = 2.0
"""Time in which clients have to read the last messages [s]."""


class _LogLines(logging.Handler):
    """Lets the process that moves the arm write the log."""

    def __init__(self, link: OwnerProxy) -> None:
        super().__init__()
        self._link = link
        # Here, too: a line of a hostile client must not cost the owner a message each.
        self.addFilter(LogLimit())

    def emit(self, record: logging.LogRecord) -> None:
        """Pass a line on; called in the thread of the clients."""
        text = record.getMessage()
        if record.exc_info:
            text += "\n" + logging.Formatter().formatException(record.exc_info)
        self._link.send(c.LogLine(record.levelno, record.name, printable(text[:4000])))


def serve_clients(channel: socket.socket, listeners: socket.socket) -> None:
    """Answer clients until the other process ends, or releases the arm.

    Args:
        channel: Connected to the process that moves the arm.
        listeners: Gets the sockets on which clients connect, and processes from which others fork,
            each in place of the one before.
    """
    name_process("bioscara-api")
    # Each client needs two files.
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))
    sys.setswitchinterval(_SWITCH_INTERVAL)
    wake_on_time()
    asyncio.run(_serve(channel, listeners))


async def _serve(channel: socket.socket, listeners: socket.socket) -> None:
    loop, link = asyncio.get_running_loop(), OwnerProxy()
    logging.getLogger().handlers[:] = [_LogLines(link)]
    logging.getLogger().setLevel(logging.INFO)
    await loop.create_connection(lambda: link, sock=channel)
    await asyncio.wait([link.begun, link.ended], return_when=asyncio.FIRST_COMPLETED)
    if not link.begun.done():
        return
    link.start()
    server = ApiServer(link, link.group)
    link.on_record = server.send_record
    server.start()

    def take() -> None:
        what, files, _, _ = socket.recv_fds(listeners, 1, 1)
        if not files:
            loop.remove_reader(listeners)
        elif what == NURSERY:
            nursery.adopt(files[0])
        else:
            listening = server.listen(socket.socket(fileno=files[0]))
            listening.add_done_callback(lambda _: link.send(c.Ready(os.getpid())))

    listeners.setblocking(False)
    loop.add_reader(listeners, take)
    watching = loop.create_task(link.watch())
    await link.ended
    watching.cancel()
    loop.remove_reader(listeners)
    with suppress(TimeoutError):
        await asyncio.wait_for(server.close(), _LAST)
    await link.close()
    channel.close()
