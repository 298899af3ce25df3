"""The process of the clients keeps little, however much its clients ask and send."""

from __future__ import annotations

import random
import subprocess
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path

import pytest

from bioscara.api import messages as m
from bioscara.robot import tasks
from hostile.moving_arm import memory_of
from hostile.owner_flood import QUESTIONS
from processes_of import only
from programs import environment, wait_for_line
from served import NAME, RawClient, runtime_folder

Start = Callable[..., subprocess.Popen[str]]
BLOCK = 16
"""Questions of each client that wait at once."""
LINES = 2000
"""Lines of the log, all that are kept."""


ASKED = [
    each
    for each in QUESTIONS
    if not (isinstance(each, m.MakePlan) and isinstance(each.motion, tasks.MoveSequence))
]
"""All questions, but for paths, each of which is planned for a second."""


@pytest.fixture
def owner(start: Start, tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    with runtime_folder() as folder:
        process = start(
            *("-m", "bioscara", "serve", "--name", NAME, "--homed"),
            env=environment(BIOSCARA_RUNTIME=str(folder)),
            cwd=tmp_path,
            stderr=subprocess.DEVNULL,
        )
        wait_for_line(process, "is served")
        yield process


def ask(clients: list[RawClient], seed: int, count: int) -> None:
    """Let the clients ask as many questions in all, each the same ones; all kinds equally often."""

    def some(client: RawClient) -> None:
        chance = random.Random(seed)
        for _ in range(count // (BLOCK * len(clients))):
            numbers = [client.begin(each) for each in chance.choices(ASKED, k=BLOCK)]
            for number in numbers:
                client.answer(number)
            client.events.clear()
            client.samples.clear()

    with ThreadPoolExecutor(len(clients)) as threads:
        for done in [threads.submit(some, client) for client in clients]:
            done.result()


@pytest.mark.thorough
@pytest.mark.timeout(600)
def test_forty_thousand_questions_of_eight_viewers_leave_little(
    owner: subprocess.Popen[str],
) -> None:
    process = only(owner, "bioscara-api")
    with ExitStack() as stack:
        clients = [stack.enter_context(RawClient(f"viewer {number}")) for number in range(8)]
        before = memory_of(process)
        for _ in range(LINES // 8):
            for client in clients:
                client.request(m.Report("r" * 100))
        first = kept(process, clients, 1) - before
        second = kept(process, clients, 2) - before
        assert first < 150 << 20, f"{first / 2**20:.0f} MiB"
        assert second < first + (5 << 20), f"{first / 2**20:.0f}, {second / 2**20:.0f} MiB"


def kept(process: int, clients: list[RawClient], seed: int) -> int:
    """Return the memory of a process after 20,000 questions [byte], the least of some moments."""
    ask(clients, seed, 18_000)
    found = []
    for _ in range(8):
        ask(clients, seed, 256)
        found.append(memory_of(process))
    return min(found)
