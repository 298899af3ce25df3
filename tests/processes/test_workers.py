"""Work in processes: results and errors come back; time, memory and turns are bounded."""

from __future__ import annotations

import asyncio
import os
import signal
import time
from collections.abc import Iterator

import pytest

from bioscara.errors import BusyOwnerError, EffortError, LimitError, TrajectoryError
from bioscara.processes.worker import Worker
from bioscara.processes.worker_pool import WorkerPool
from programs import LIMIT

MEMORY = 64


def _refuse(value: float) -> None:
    raise LimitError("the value", value, 0.0, 1.0, "mm") from TrajectoryError("inner")


def _fill(size: int) -> int:
    return len(bytearray(size))


def _fail(_: int) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


@pytest.fixture(scope="module")
def worker() -> Iterator[Worker]:
    worker = Worker(memory=MEMORY, nice=1)
    worker.start()
    yield worker
    worker.close()


def test_results_and_errors_come_back(worker: Worker) -> None:
    assert worker.call(LIMIT, pow, 2, 10) == 1024
    with pytest.raises(LimitError, match="the value") as caught:
        worker.call(LIMIT, _refuse, 3.0)
    assert (caught.value.value, caught.value.upper) == (3.0, 1.0)
    assert os.getpid() not in {worker.call(LIMIT, os.getpid), worker.call(LIMIT, os.getppid)}


def test_time_and_memory_are_bounded_and_the_next_call_works(worker: Worker) -> None:
    with pytest.raises(EffortError, match="longer than"):
        worker.call(0.05, time.sleep, LIMIT)
    assert worker.call(LIMIT, _fill, 1 << 20) == 1 << 20
    pid = worker.call(LIMIT, os.getpid)
    with pytest.raises(EffortError, match=f"more than {MEMORY} MiB"):
        worker.call(LIMIT, _fill, 4 * MEMORY << 20)
    assert worker.call(LIMIT, os.getpid) == pid
    with pytest.raises(EffortError, match="has ended"):
        worker.call(LIMIT, _fail, 0)
    worker.interrupt()
    assert worker.call(LIMIT, pow, 2, 2) == 4


def test_clients_have_turns_and_one_that_leaves_ends_its_work() -> None:
    async def run() -> None:
        pool = WorkerPool("test", 1, memory=MEMORY, nice=0, each=2, most=4)
        pool.start()
        ended: list[str] = []

        async def ask(client: str, seconds: float) -> None:
            await pool.run(client, LIMIT, time.sleep, seconds)
            ended.append(client)

        greedy = [asyncio.create_task(ask("greedy", LIMIT)) for _ in range(2)]
        await asyncio.sleep(0.0)
        with pytest.raises(BusyOwnerError, match="2 requests of this client"):
            await pool.run("greedy", LIMIT, pow, 2, 2)
        other = asyncio.create_task(ask("other", 0.0))
        await asyncio.sleep(0.0)
        greedy[0].cancel()
        await asyncio.wait_for(other, LIMIT)
        assert ended == ["other"]
        greedy[1].cancel()
        await asyncio.gather(*greedy, return_exceptions=True)
        assert await pool.run("greedy", LIMIT, pow, 2, 2) == 4
        await pool.close()
        with pytest.raises((EffortError, RuntimeError)):
            await pool.run("late", LIMIT, pow, 2, 2)

    asyncio.run(run())
