"""A process that does not answer hangs where it could have answered, and is starved otherwise."""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import time
from collections.abc import Callable, Iterator

import pytest

from bioscara.errors import EffortError
from bioscara.processes import nursery
from bioscara.processes.supervision import PATIENCE, PERIOD, Condition, Heartbeat
from bioscara.processes.worker import Worker
from programs import LIMIT, wait_for_line

Start = Callable[..., subprocess.Popen[str]]
BUSY = """
import signal, time
signal.signal(signal.SIGUSR1, lambda *_: print("answer", flush=True))
print("begun", flush=True)
while True:
    PAUSE
"""


def asked(process: subprocess.Popen[str], *, answers: int) -> tuple[Heartbeat, list[float]]:
    """Return the heartbeat of a process that answers so many questions, and their times."""
    questions: list[float] = []

    def ask() -> None:
        questions.append(time.monotonic())
        if len(questions) <= answers:
            heartbeat.answer()

    heartbeat = Heartbeat(process.pid, ask)
    return heartbeat, questions


def first(heartbeat: Heartbeat, *wanted: Condition) -> tuple[Condition, float]:
    """Look until the process is in one of these conditions; return it and the time [s]."""
    begin = time.monotonic()
    while (condition := heartbeat.look()) not in wanted:
        assert time.monotonic() - begin < LIMIT
        time.sleep(PERIOD)
    return condition, time.monotonic() - begin


@pytest.mark.parametrize(
    ("pause", "number"),
    [("time.sleep(60)", signal.SIGSTOP), ("pass", signal.SIGSTOP), ("time.sleep(60)", None)],
)
def test_a_process_that_is_stopped_or_asleep_hangs_after_a_second(
    start: Start, pause: str, number: int | None
) -> None:
    process = start("-c", BUSY.replace("PAUSE", pause))
    wait_for_line(process, "begun")
    heartbeat, questions = asked(process, answers=3)
    for _ in range(3):
        assert heartbeat.look() is Condition.ANSWERS
        time.sleep(PERIOD)
    if number is not None:
        process.send_signal(number)
    condition, waited = first(heartbeat, Condition.HUNG, Condition.STARVED)
    assert condition is Condition.HUNG
    assert waited >= PATIENCE
    assert len(questions) == 4
    process.kill()
    assert first(heartbeat, Condition.ENDED)[0] is Condition.ENDED


def test_a_process_that_computes_is_starved_before_it_hangs(start: Start) -> None:
    process = start("-c", BUSY.replace("PAUSE", "pass"))
    wait_for_line(process, "begun")
    heartbeat, _ = asked(process, answers=1)
    heartbeat.look()
    assert first(heartbeat, Condition.HUNG, Condition.STARVED)[0] is Condition.STARVED
    # The answer comes late; then it does nothing else for two seconds.
    heartbeat.answer()
    assert first(heartbeat, Condition.STARVED)[1] >= PATIENCE
    assert first(heartbeat, Condition.HUNG)[0] is Condition.HUNG


def test_one_that_has_not_begun_has_more_time_and_a_watcher_that_slept_counts_anew(
    start: Start,
) -> None:
    process = start("-c", BUSY.replace("PAUSE", "time.sleep(60)"))
    wait_for_line(process, "begun")
    process.send_signal(signal.SIGSTOP)
    begins, _ = asked(process, answers=0)
    heartbeat, _ = asked(process, answers=1)
    for _ in range(15):
        assert begins.look() is Condition.ANSWERS
        time.sleep(PERIOD)
    heartbeat.look()
    heartbeat.look()
    time.sleep(1.5 * PATIENCE)
    assert heartbeat.look() is Condition.ANSWERS
    assert first(heartbeat, Condition.HUNG)[1] >= PATIENCE


def test_a_worker_that_is_stopped_keeps_its_limit_of_time(worker_of_test: Worker) -> None:
    megabytes = bytes(8 << 20)
    for function, value in ((len, megabytes), (bytes, 8 << 20)):
        pid = worker_of_test.call(LIMIT, os.getpid)
        os.kill(pid, signal.SIGSTOP)
        begin = time.monotonic()
        with pytest.raises(EffortError, match=r"longer than 0\.5 s"):
            worker_of_test.call(0.5, function, value)
        assert time.monotonic() - begin < 5.0
        assert worker_of_test.call(LIMIT, os.getpid) != pid


@pytest.fixture
def worker_of_test() -> Iterator[Worker]:
    worker = Worker(memory=256)
    yield worker
    worker.close()


def test_a_nursery_that_hangs_is_replaced(worker_of_test: Worker) -> None:
    nursery.start_early(("bioscara.processes.worker",))
    former, texts = nursery._nursery._pid, list[str]()

    async def run() -> None:
        replaced = asyncio.Event()
        supervising = asyncio.create_task(nursery.supervise(texts.append, replaced.set))
        await asyncio.wait_for(nursery.until_answered(), LIMIT)
        # It has answered the supervision, too.
        await asyncio.sleep(3.0 * PERIOD)
        os.kill(former, signal.SIGSTOP)
        await asyncio.wait_for(nursery.until_answered(), LIMIT)
        await asyncio.wait_for(replaced.wait(), LIMIT)
        supervising.cancel()

    asyncio.run(run())
    assert nursery._nursery._pid != former
    assert texts == ["the process from which others fork hangs, and is started again"]
    assert worker_of_test.call(LIMIT, pow, 2, 3) == 8
