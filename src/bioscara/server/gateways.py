"""Programs that serve others, each a client of the owner, started again when they end or hang."""

from __future__ import annotations

import asyncio
import logging
import signal
import socket
from collections.abc import Callable, Sequence
from contextlib import suppress

from bioscara.api import messages as m
from bioscara.processes.child_process import asked_at, child_command
from bioscara.processes.supervision import Heartbeat, until_lost

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
            ours, theirs = socket.socketpair()
            with ours:
                with theirs:
                    process = await asyncio.create_subprocess_exec(
                        *child_command([name, "--arm", self._arm, *words[1:]]),
                        env=asked_at(theirs),
                        pass_fds=[theirs.fileno()],
                    )
                self._processes[words] = process
                self._announce("gateway", f"{name} runs as process {process.pid}")
                watching = loop.create_task(self._watch(name, process, ours))
                try:
                    status = await process.wait()
                finally:
                    watching.cancel()
            del self._processes[words]
            if loop.time() - begin >= _STABLE:
                wait = _FIRST
            reason = signal.Signals(-status).name if status < 0 else f"status {status}"
            text = f"{name} ended with {reason}; it is started again in {wait:g} s"
            _log.warning("%s", text)
            self._announce("gateway", text)
            await asyncio.sleep(wait)
            wait = min(2.0 * wait, _LONGEST)

    async def _watch(
        self, name: str, process: asyncio.subprocess.Process, questions: socket.socket
    ) -> None:
        """Kill a gateway that hangs; it is started again as one that has ended."""
        questions.setblocking(False)
        loop = asyncio.get_running_loop()

        def answered() -> None:
            with suppress(BlockingIOError):
                if not questions.recv(64):
                    loop.remove_reader(questions)
            heartbeat.answer()

        def ask() -> None:
            with suppress(OSError):
                questions.send(b"?")

        heartbeat = Heartbeat(process.pid, ask)
        loop.add_reader(questions, answered)
        starved = f"{name} does not answer, as it gets no processor"
        try:
            if await until_lost(heartbeat, lambda: self._announce("gateway", starved)):
                self._announce("gateway", f"{name} hangs, and is killed")
                process.kill()
        finally:
            loop.remove_reader(questions)
