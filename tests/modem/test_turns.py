"""When turns are taken: after a call, after the time that the last one wanted, and never else."""

import asyncio

import pytest

from sdrlinkd.modem.testing import INFINITE, Turns


class Waits:
    """A turn that returns these waits, and then that there is nothing to do."""

    def __init__(self, *waits):
        self._waits = list(waits)
        self.taken = 0
        self.moved = asyncio.Event()

    def __call__(self):
        self.taken += 1
        self.moved.set()
        wait = self._waits.pop(0) if self._waits else INFINITE
        if isinstance(wait, Exception):
            raise wait
        return wait

    async def until(self, n):
        while self.taken < n:
            self.moved.clear()
            await self.moved.wait()


async def settled():
    for _ in range(5):
        await asyncio.sleep(0)


async def running(turns):
    task = asyncio.ensure_future(turns.run())
    await settled()
    return task


async def ended(task):
    task.cancel()
    await asyncio.wait([task])


async def test_a_turn_is_taken_at_the_start_and_for_each_call():
    turn = Waits()
    turns = Turns(turn, lambda: True)
    task = await running(turns)
    assert turn.taken == 1
    for _ in range(3):
        turns.wake()
    await settled()
    assert turn.taken == 2, "calls before the turn are one"
    await ended(task)


async def test_turns_without_a_wait_follow_at_once_and_let_others_run():
    turn = Waits(0, 0, 0)
    task = await running(Turns(turn, lambda: False))
    assert turn.taken == 4
    await ended(task)


@pytest.mark.parametrize("wait_s", [1e-9, 0.005])
async def test_a_turn_is_taken_when_its_time_has_come(wait_s):
    turn = Waits(wait_s)
    task = await running(Turns(turn, lambda: True))
    async with asyncio.timeout(5):
        await turn.until(2)
    await ended(task)


async def test_without_a_timer_time_alone_leads_to_no_turn():
    turn, has_timer = Waits(1e-9, 1e-9), False
    turns = Turns(turn, lambda: has_timer)
    task = await running(turns)
    await asyncio.sleep(0.01)
    assert turn.taken == 1
    has_timer = True
    turns.wake()
    async with asyncio.timeout(5):
        await turn.until(3)
    await ended(task)


async def test_a_call_replaces_the_timer():
    turn = Waits(60.0, 60.0)
    turns = Turns(turn, lambda: True)
    task = await running(turns)
    turns.wake()
    await settled()
    assert turn.taken == 2
    await ended(task)


async def test_what_a_turn_raises_ends_the_run_and_nothing_follows():
    turn = Waits(0, ValueError("a bug"))
    turns = Turns(turn, lambda: True)
    with pytest.raises(ValueError, match="a bug"):
        await turns.run()
    turns.wake()
    await settled()
    assert turn.taken == 2


async def test_after_its_end_no_turn_is_taken():
    turn = Waits(1e-9)
    turns = Turns(turn, lambda: True)
    task = await running(turns)
    await ended(task)
    turns.wake()
    await asyncio.sleep(0.01)
    assert turn.taken == 1
