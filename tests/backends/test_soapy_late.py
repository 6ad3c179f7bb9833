"""Bursts that a device rejects as late: each is given up once, and the next ones leave."""

import asyncio
import os
import time
from collections import deque
from types import SimpleNamespace

import numpy as np
import pytest

from backends import SoapyRadio, SoapySettings, TxBurst, TxOutcome
from backends.soapy.binding import END_BURST, NOT_SUPPORTED, StreamResult
from backends.soapy.protocol import TxCommand
from backends.testing import SampleClock, TimestampedTransmitter, TxStream
from tests.backends.radios import RATE, N, noise, opened, take, turn
from tests.soapy_loopback import Bus, missing

needs_radio = pytest.mark.skipif(bool(missing()), reason=missing())
NEEDED_S = 0.06
"""Lead that the device requires."""
SOON_S, IN_TIME_S = NEEDED_S / 2, 0.2
"""A lead too short for the device but not for us, and one long enough on any normal machine."""


@pytest.fixture
def bus(request):
    """An air for this test alone."""
    with Bus(f"{os.getpid()}-{abs(hash(request.node.name)) % 10**6}") as found:
        yield found


def radio(bus, tells, more=""):
    """A device that reports late bursts in the way `tells`."""
    return SoapyRadio(
        SoapySettings(
            device=f"driver=loopback,model=plain,noise_db=-200,mtu={N},bus={bus.name},unit=0,"
            f"late={tells},txlat_us={1e6 * NEEDED_S:g}{more}",
            rate_hz=0.0, frequency_hz=0.0, block_s=N / RATE, tx_enabled=True, tx_gain_db=40.0,
            rx_gain_db=20.0, lead_s=0.001, dc_block=False,
        ),
        longest_s=0.1,
    )  # fmt: skip


async def answers(blocks, sends):
    """The radio's reports of these bursts."""
    while not all(each.done() for each in sends):
        await take(blocks, 1)
        await turn()
    return [(await each).outcome for each in sends]


async def sent_at_last(each, blocks):
    """Send bursts one after another until one leaves; returns the outcomes."""
    outcomes = []
    while TxOutcome.SENT not in outcomes:
        now = (await take(blocks, 1))[-1].index
        sends = [asyncio.ensure_future(each.send(TxBurst(now + round(IN_TIME_S * RATE), noise(N))))]
        await turn()
        outcomes += await answers(blocks, sends)
    return outcomes


@pytest.mark.slow
@needs_radio
@pytest.mark.parametrize("tells", ["status", "return"])
async def test_a_late_burst_is_given_up_and_holds_up_none_behind_it(bus, tells):
    """The device reports each late burst once: it is not retried."""
    async with opened(radio(bus, tells)) as each:
        blocks = each.blocks()
        now = (await take(blocks, 20 * N))[-1].index
        soon = now + round(SOON_S * RATE)
        late = [TxBurst(soon + 2 * i * N, noise(N), latest=soon + 2 * i * N) for i in range(3)]
        sends = [asyncio.ensure_future(each.send(burst)) for burst in late]
        await turn()
        assert await answers(blocks, sends) == [TxOutcome.LATE] * 3
        more = await sent_at_last(each, blocks)
        n_late = 3 + more.count(TxOutcome.LATE)
        assert each.counters["late"] == n_late
        # Bursts that were late for ourselves never reached the device.
        assert 1 <= bus.stats(0).late <= n_late


@pytest.mark.slow
@needs_radio
async def test_what_has_begun_to_leave_is_closed_and_does_not_go_again(bus):
    """The device's queue is shorter than the burst."""
    async with opened(radio(bus, "return", f",txbuf={2 * N}")) as each:
        blocks = each.blocks()
        now = (await take(blocks, 20 * N))[-1].index
        long = TxBurst(now + round(IN_TIME_S * RATE), noise(20 * N))
        sends = [asyncio.ensure_future(each.send(long))]
        while not bus.stats(0).sent:
            await take(blocks, 1)
            await turn()
        bus.inject(0, "time_error")
        assert await answers(blocks, sends) == [TxOutcome.UNDERFLOW]
        assert bus.stats(0).sent < 20 * N
        # END_BURST was sent all the same.
        assert bus.stats(0).bursts == 1
        await sent_at_last(each, blocks)


def test_the_last_sample_of_a_burst_is_zero():
    """Some devices hold the last sample on the air until the next burst."""
    written = []
    stream = SimpleNamespace(
        mtu=100,
        activate=lambda: 0,
        deactivate=lambda: 0,
        status=lambda _: StreamResult(NOT_SUPPORTED, 0, 0),
        write=lambda values, flags, *_: (
            written.append((values.copy(), flags)) or StreamResult(len(values), 0, 0)
        ),
    )
    commands = SimpleNamespace(
        waiting=deque([TxCommand(1, 1000, 250, 0, None)]),
        is_over=False,
        wait=lambda _: None,
        samples=lambda command: np.ones(command.n, np.complex64),
        done=lambda *_: None,
    )
    clock = SampleClock(RATE, is_stamped=True)
    clock.begin(0)
    clock.saw(0, time.monotonic_ns())
    TimestampedTransmitter(commands, TxStream(stream, "CF32"), clock).step()
    sent = np.concatenate([values for values, _ in written])
    assert np.array_equal(sent[:250], np.ones(250))
    assert not sent[250:].any()
    assert 250 < len(sent) <= 250 + 16
    assert [bool(flags & END_BURST) for _, flags in written] == [False, True]
    assert len(written[-1][0]) <= stream.mtu
