"""Programs beside the owner, each a client of it, started again when they end."""

from __future__ import annotations

import asyncio
import logging
import signal
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress

from bioscara.errors import ConfigurationError
from bioscara.spelling import did_you_mean

KINDS = {"web": ("web",), "record": ("record",)}
"""Words of ``bioscara`` that run each gateway."""
_FIRST, _LONGEST = 1.0, 60.0
"""Shortest and longest wait before one is started again [s]; each wait is twice as long."""
_STABLE = 60.0
"""Time after which a gateway counts as working, and its next wait is the shortest [s]."""
_PATIENCE = 10.0
"""Time in which one has to end [s]."""

_log = logging.getLogger(__name__)


def require_known(names: Sequence[str]) -> tuple[str, ...]:
    """Return the names of gateways.

    Raises:
        ConfigurationError: There is none of such a name.
    """
    for name in names:
        if name not in KINDS:
            hint = did_you_mean(name, KINDS, f"there are {', '.join(KINDS)}")
            raise ConfigurationError(f"there is no gateway {name!r}; {hint}")
    return tuple(dict.fromkeys(names))


class Gateways:
    """Runs gateways until :meth:`close`.

    Args:
        names: Which ones.
        arm: Name of the owner.
        announce: Reports what happened to one.
    """

    def __init__(
        self, names: Sequence[str], arm: str, announce: Callable[[str, str], object]
    ) -> None:
        self._names, self._arm, self._announce = require_known(names), arm, announce
        self._tasks: list[asyncio.Task[None]] = []
        self.processes: dict[str, asyncio.subprocess.Process] = {}

    def start(self) -> None:
        """Begin to run them, in the running event loop."""
        loop = asyncio.get_running_loop()
        self._tasks = [loop.create_task(self._supervise(name)) for name in self._names]

    async def close(self) -> None:
        """End them; those that do not end in time are killed."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        running = list(self.processes.values())
        for process in running:
            with suppress(ProcessLookupError):
                process.terminate()
        for process in running:
            try:
                await asyncio.wait_for(process.wait(), _PATIENCE)
            except TimeoutError:
                process.kill()
                await process.wait()

    async def _supervise(self, name: str) -> None:
        loop, wait = asyncio.get_running_loop(), _FIRST
        while True:
            begin = loop.time()
            process = await asyncio.create_subprocess_exec(
                sys.executable, "-m", "bioscara", *KINDS[name], "--arm", self._arm
            )
            self.processes[name] = process
            self._announce("gateway", f"{name} runs as process {process.pid}")
            status = await process.wait()
            del self.processes[name]
            if loop.time() - begin >= _STABLE:
                wait = _FIRST
            reason = signal.Signals(-status).name if status < 0 else f"status {status}"
            text = f"{name} ended with {reason}; it is started again in {wait:g} s"
            _log.warning("%s", text)
            self._announce("gateway", text)
            await asyncio.sleep(wait)
            wait = min(2.0 * wait, _LONGEST)
