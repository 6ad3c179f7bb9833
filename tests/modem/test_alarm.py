"""An alarm for the event loop."""

import asyncio
import time

import pytest
import uvloop

from sdrlinkd.modem.alarm import Alarm


@pytest.fixture(params=["asyncio", "uvloop"])
def run(request):
    """Runs a coroutine on either event loop."""
    make = uvloop.new_event_loop if request.param == "uvloop" else asyncio.new_event_loop

    def call(coroutine):
        with asyncio.Runner(loop_factory=make) as runner:
            return runner.run(coroutine)

    return call


@pytest.mark.parametrize("seconds", [0.0, 2e-4, 0.0015, 1.01])
def test_it_rings_once_and_never_early(run, seconds):
    async def ring():
        rung = asyncio.Event()
        rings = []
        alarm = Alarm(lambda: (rings.append(time.monotonic()), rung.set()))
        began = time.monotonic()
        alarm.set(seconds)
        await rung.wait()
        await asyncio.sleep(0.01)
        alarm.close()
        return [at - began for at in rings]

    (took_s,) = run(ring())
    assert took_s >= seconds


def test_it_rings_when_it_was_set_last(run):
    async def ring():
        rung = asyncio.Event()
        alarm = Alarm(rung.set)
        alarm.set(3600.0)
        began = time.monotonic()
        alarm.set(0.05)
        alarm.set(0.02)
        await rung.wait()
        alarm.close()
        return time.monotonic() - began

    assert 0.02 <= run(ring()) < 3600


def test_a_closed_alarm_does_not_ring(run):
    async def ring():
        rings = []
        alarm = Alarm(lambda: rings.append(1))
        alarm.set(0.001)
        alarm.close()
        await asyncio.sleep(0.02)
        return rings

    assert run(ring()) == []
