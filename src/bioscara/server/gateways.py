"""Programs that serve others, each a client of the owner, started again when they end."""

from __future__ import annotations

import asyncio
import logging
import signal
from collections.abc import Callable, Sequence
from contextlib import suppress

from bioscara.api import messages as m
from bioscara.processes.child_process import child_command

_FIRST, _LONGEST = 1.0, 60.0
"""Shortest and longest wait before one is started again [s]; each wait is twice as long."""
_STABLE = 60.0
"""Time after which a gateway counts as working, and its next wait is the shortest [s]."""
_PATIENCE = 10.0
"""Time in which one has to end [s]."""

_log = logging.getLogger(__name__)


class Gateways:
    """Runs gateways until :meth:`close`, or until this process ends otherwise.

    Args:
        commands: Words of ``bioscara`` that run each one.
        arm: Name of the owner.
        announce: Reports what happened to one.
    """

    def __init__(
        self,
        commands: Sequence[tuple[str, ...]],
        arm: str,
        announce: Callable[[m.EventKind, str], object],
    ) -> None:
        self._commands, self._arm, self._announce = commands, arm, announce
        self._tasks: list[asyncio.Task[None]] = []
        self._processes: dict[tuple[str, ...], asyncio.subprocess.Process] = {}

    def start(self) -> None:
        """Begin to run them, in the running event loop."""
        loop = asyncio.get_running_loop()
        commands = dict.fromkeys(self._commands)
        self._tasks = [loop.create_task(self._supervise(words)) for words in commands]

    async def close(self) -> None:
        """End them; those that do not end in time are killed."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        running = list(self._processes.values())
        for process in running:
            with suppress(ProcessLookupError):
                process.terminate()
        for process in running:
            try:
                await asyncio.wait_for(process.wait(), _PATIENCE)
            except TimeoutError:
                process.kill()
                await process.wait()

    async def _supervise(self, words: tuple[str, ...]) -> None:
        loop, wait, name = asyncio.get_running_loop(), _FIRST, words[0]
        while True:
            begin = loop.time()
            # The arm comes before options: all that follows --ros-args is for ROS.
            process = await asyncio.create_subprocess_exec(
                *child_command([name, "--arm", self._arm, *words[1:]])
            )
            self._processes[words] = process
            self._announce("gateway", f"{name} runs as process {process.pid}")
            status = await process.wait()
            del self._processes[words]
            if loop.time() - begin >= _STABLE:
                wait = _FIRST
            reason = signal.Signals(-status).name if status < 0 else f"status {status}"
            text = f"{name} ended with {reason}; it is started again in {wait:g} s"
            _log.warning("%s", text)
            self._announce("gateway", text)
            await asyncio.sleep(wait)
            wait = min(2.0 * wait, _LONGEST)
