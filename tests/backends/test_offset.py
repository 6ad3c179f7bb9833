"""A radio with offset tuning, and the leakage of its oscillator."""

import asyncio

import numpy as np
import pytest

from backends import LoopbackRadio, OffsetRadio, OversampledRadio
from backends.testing import DcBlocker
from tests.backends.radios import (
    AIR,
    BLOCK_S,
    TUNING,
    N,
    hand_over,
    heard,
    noise,
    opened,
    send,
    take,
    turn,
)
from tests.backends.two_bursts import assert_heard, two_bursts

pytestmark = pytest.mark.usefixtures("at_ease")


class Tuned(LoopbackRadio):
    """A radio that remembers its frequency."""

    async def open(self, tuning):
        self.tuning = tuning
        await super().open(tuning)


async def test_the_channel_is_where_it_was():
    """Sending shifts up and receiving shifts down: only a phase remains."""
    inner = Tuned(AIR, BLOCK_S, paced=False)
    async with opened(OversampledRadio(OffsetRadio(inner), 4)) as radio:
        assert inner.tuning.frequency_hz == TUNING.frequency_hz - TUNING.rate_hz
        blocks = radio.blocks()
        reports, taken = await send(radio, blocks, sent := two_bursts(700))
        taken += await take(blocks, reports[-1].end + 500)
    assert_heard(heard(taken), sent, reports)


async def test_what_is_heard_where_it_is_made_is_the_same():
    there, sent = [], two_bursts(700)
    inner = Tuned(AIR, BLOCK_S, paced=False)
    async with opened(OversampledRadio(OffsetRadio(inner), 4)) as radio:
        sends = await hand_over(radio, sent)

        async def listen():
            async for _ in radio.blocks(there.append):
                raise AssertionError("heard already")

        listening = asyncio.ensure_future(listen())
        reports = await asyncio.gather(*sends)
        while there[-1].index < reports[-1].end + 500:
            await turn()
    await listening
    assert_heard(heard(there), sent, reports)


async def test_what_is_sent_is_beside_the_oscillator():
    inner = Tuned(AIR, BLOCK_S, paced=False)
    seen = []
    inner.send = lambda burst: seen.append(burst)
    radio = OffsetRadio(inner)
    tone = np.ones(4096, np.complex64)
    radio.send(two_bursts(0)[0]._replace(samples=tone))
    spectrum = np.abs(np.fft.fft(seen[0].samples))
    assert spectrum.argmax() == 4096 // 4


def test_a_constant_goes_and_the_rest_stays():
    blocker = DcBlocker()
    for seed in range(300):
        clean = blocker.push(noise(N, seed) + np.complex64(0.3 - 0.1j))
    assert abs(clean.mean() - noise(N, 299).mean()) < 0.02
    assert np.abs(clean - noise(N, 299)).max() < 0.03
