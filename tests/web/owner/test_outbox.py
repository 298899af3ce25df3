"""Messages that wait for a slow client."""

from __future__ import annotations

import asyncio

import msgspec

from bioscara.api import framing, messages as m
from bioscara.web.owner import outbox
from bioscara.web.owner.outbox import Outbox

EVENT = framing.encode_json(m.Event(number=1, time=0.0, wall=0.0, what="stop", text="stopped"))


def sample(cycle: int) -> bytes:
    fields = dict.fromkeys(m.StateSample.__struct_fields__)
    return msgspec.json.encode({"kind": "state", **fields, "cycle": cycle})


async def waits(task: asyncio.Task[None]) -> bool:
    for _ in range(5):
        await asyncio.sleep(0)
    return not task.done()


def test_the_newest_sample_replaces_older_ones_and_nothing_else_is_lost() -> None:
    async def run() -> list[bytes | None]:
        box = Outbox()
        for message in (sample(1), EVENT, sample(2), b'{"kind":"response","id":1}', sample(3)):
            await box.put(message)
        box.end()
        return [await box.take() for _ in range(4)]

    assert asyncio.run(run()) == [EVENT, b'{"kind":"response","id":1}', sample(3), None]


def test_an_encoded_sample_is_recognised() -> None:
    values = dict.fromkeys(m.StateSample.__struct_fields__)
    state = m.StateSample(**values)  # type: ignore[arg-type]
    assert framing.encode_json(state).startswith(outbox._SAMPLE)
    answer = m.Response(1, state)
    assert not framing.encode_json(answer).startswith(outbox._SAMPLE)


def test_it_takes_no_more_than_its_limit_until_there_is_room() -> None:
    async def run() -> None:
        box, long = Outbox(), b"x" * (outbox.MOST // 2)
        for _ in range(3):
            await box.put(long)
        waiting = asyncio.create_task(box.put(EVENT))
        assert await waits(waiting)
        await box.put(sample(1))  # A sample never waits.
        await box.take()
        await waiting
        assert [await box.take() for _ in range(4)] == [long, long, EVENT, sample(1)]

    asyncio.run(run())
