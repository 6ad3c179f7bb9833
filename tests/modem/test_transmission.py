"""Bursts on their way to a radio: none overtakes a late one."""

import asyncio

import numpy as np
import pytest

import phy
from backends import GAP, Capabilities, TxOutcome, TxReport
from sdrlinkd.config import ModemParams
from sdrlinkd.link import Outcome
from sdrlinkd.modem.testing import SHORT, BurstOrder, Transmission
from sdrlinkd.wire import postponed
from tests.wire.vectors import BY_NAME


class Radio:
    """A radio that accepts bursts and reports nothing until told to."""

    def __init__(self, lockstep):
        self.capabilities = Capabilities(True, True, True, True, not lockstep, lockstep=lockstep)
        self.counters = {"late": 0}
        self.taken = []
        self.arrivals = asyncio.Queue()

    def send(self, burst):
        answer = asyncio.get_running_loop().create_future()
        self.taken.append((burst, answer))
        self.arrivals.put_nowait(len(self.taken))
        return answer

    def tell(self, number, outcome, start):
        self.counters["late"] += outcome is TxOutcome.LATE
        self.taken[number][1].set_result(TxReport(outcome, start, start))


LONG = 63
"""PDUs of a burst that is modulated in a thread."""


def made(number, start=0, latest=1_000_000, n_pdus=1, late_known=0):
    return BurstOrder(number, start, latest, late_known, 0, n_pdus * [bytes([number]) * 32])


def test_a_long_burst_is_long():
    assert phy.layout(phy.OFDM_64_16, 0, LONG, 32).n_samples > SHORT


@pytest.mark.parametrize("lockstep", [False, True], ids=["in-a-thread", "here"])
@pytest.mark.parametrize("composed", ["before", "between"])
async def test_what_was_composed_before_a_late_one_was_known_goes_back_too(lockstep, composed):
    """The radio has reported, but no task has been woken up yet."""
    radio, left, settled = Radio(lockstep), [], asyncio.Event()

    def note(report):
        left.append((report.number, report.outcome))
        if len(left) == 2:
            settled.set()

    async with asyncio.TaskGroup() as tasks, asyncio.timeout(60):
        transmission = Transmission(ModemParams(rate_hz=1e6), radio)
        await asyncio.to_thread(phy.warm_up)
        transmission.start(tasks, note)
        transmission.send(made(1, 500_000))
        await radio.arrivals.get()
        if composed == "before" and not lockstep:
            transmission.send(made(2, 510_000, n_pdus=LONG))
        radio.tell(0, TxOutcome.LATE, 500_000)
        if composed == "between" or lockstep:
            transmission.send(made(2, 510_000, n_pdus=LONG))
        await settled.wait()
        assert left == [(1, Outcome.LATE), (2, Outcome.LATE)]
        assert len(radio.taken) == 1
        transmission.send(made(3, 520_000, late_known=2))
        await radio.arrivals.get()
        radio.tell(1, TxOutcome.SENT, 520_000)
    assert left[2:] == [(3, Outcome.SENT)]
    transmission.close()


async def test_who_does_not_know_of_all_late_ones_goes_back():
    radio, left = Radio(lockstep=True), []
    async with asyncio.TaskGroup() as tasks, asyncio.timeout(60):
        transmission = Transmission(ModemParams(rate_hz=1e6), radio)
        await asyncio.to_thread(phy.warm_up)
        transmission.start(tasks, left.append)
        transmission.send(made(1, 500_000))
        radio.tell(0, TxOutcome.LATE, 500_000)
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        transmission.send(made(2, 510_000, late_known=0))
    assert [(each.number, each.outcome) for each in left] == [(1, Outcome.LATE), (2, Outcome.LATE)]
    assert len(radio.taken) == 1
    assert left[1].n_samples > 0
    transmission.close()


async def test_what_may_leave_whenever_it_can_does_not_wait_for_a_late_one():
    radio, left = Radio(lockstep=True), []
    async with asyncio.TaskGroup() as tasks, asyncio.timeout(60):
        transmission = Transmission(ModemParams(rate_hz=1e6), radio)
        await asyncio.to_thread(phy.warm_up)
        transmission.start(tasks, lambda report: left.append(report.outcome))
        transmission.send(made(1, 500_000))
        radio.tell(0, TxOutcome.LATE, 500_000)
        transmission.send(made(2, 510_000, latest=None))
        radio.tell(1, TxOutcome.SENT, 510_000)
    assert left == [Outcome.LATE, Outcome.SENT]
    assert radio.taken[0][0].latest == 1_000_000
    assert radio.taken[1][0].latest is None
    transmission.close()


async def test_a_short_burst_does_not_overtake_a_long_one():
    """Short bursts are modulated on the event loop, long ones in a thread."""
    radio = Radio(lockstep=False)
    async with asyncio.TaskGroup() as tasks, asyncio.timeout(60):
        transmission = Transmission(ModemParams(rate_hz=1e6), radio)
        await asyncio.to_thread(phy.warm_up)
        transmission.start(tasks, lambda _: None)
        transmission.send(made(1, 100))
        assert len(radio.taken) == 1
        for number, n_pdus in ((2, LONG), (3, 1), (4, 1)):
            transmission.send(made(number, 1000 * number, n_pdus=n_pdus))
        assert len(radio.taken) == 1
        for _ in range(4):
            await radio.arrivals.get()
        assert [burst.start for burst, _ in radio.taken] == [100, 2000, 3000, 4000]
        for number in range(4):
            radio.tell(number, TxOutcome.SENT, 0)
    transmission.close()


STAMPED = BY_NAME["stamp_alone"].octets
"""A PDU with a message's age."""


@pytest.fixture
async def late_by():
    """Sends orders `late` µs after the start that they name; (bursts at the radio, counters)."""

    async def call(*orders, late):
        radio, now = Radio(lockstep=False), orders[0].start + late
        async with asyncio.TaskGroup() as tasks, asyncio.timeout(60):
            transmission = Transmission(ModemParams(rate_hz=1e6), radio, lambda: now)
            await asyncio.to_thread(phy.warm_up)
            transmission.start(tasks, lambda _: None)
            for number, order in enumerate(orders):
                transmission.send(order)
                radio.tell(number, TxOutcome.SENT, radio.taken[number][0].start)
        transmission.close()
        return [burst for burst, _ in radio.taken], transmission.counters

    return call


def same_samples(burst, pdus):
    """Whether a burst at the radio holds these PDUs."""
    expected = phy.Transmitter().modulate(pdus, 0) * 10 ** (-ModemParams().backoff_db / 20)
    return np.array_equal(burst.samples, expected)


@pytest.mark.parametrize("n_timed", [0, 1, 2])
async def test_what_comes_too_late_starts_later_and_tells_its_ages_for_that(late_by, n_timed):
    order = BurstOrder(1, 500_000, None, 0, 0, [STAMPED, STAMPED], n_timed)
    (burst,), counters = await late_by(order, late=2000)
    by = burst.start - order.start
    assert 2000 < by < 2200
    later = postponed(STAMPED, by)
    assert same_samples(burst, [later if i < n_timed else STAMPED for i in range(2)])
    assert (counters["bursts_postponed"], counters["bursts_slipped"]) == (1, 0)


@pytest.mark.parametrize("late", [-1000, 0, 300])
async def test_what_comes_in_time_or_nearly_is_sent_as_it_is(late_by, late):
    order = BurstOrder(1, 500_000, None, 0, 0, [STAMPED], n_timed=1)
    (burst,), counters = await late_by(order, late=late)
    assert burst.start == 500_000
    assert same_samples(burst, [STAMPED])
    assert counters["bursts_postponed"] == 0


async def test_a_burst_behind_a_late_one_starts_after_it(late_by):
    orders = [BurstOrder(n, 500_000 + 1500 * n, None, 0, 0, [STAMPED], n_timed=1) for n in range(2)]
    (first, second), _ = await late_by(*orders, late=2000)
    assert second.start == first.start + len(first.samples) + GAP
    assert same_samples(second, [postponed(STAMPED, second.start - orders[1].start)])


async def test_what_has_a_deadline_keeps_its_start(late_by):
    """The radio reports it late, and it waits for another slot."""
    order = BurstOrder(1, 500_000, 500_100, 0, 0, [STAMPED], n_timed=1)
    (burst,), _ = await late_by(order, late=2000)
    assert (burst.start, burst.latest) == (500_000, 500_100)
    assert same_samples(burst, [STAMPED])


@pytest.mark.parametrize("lockstep", [False, True])
async def test_an_order_without_pdus_is_a_pulse(lockstep):
    radio = Radio(lockstep)
    sending = Transmission(ModemParams(), radio)
    async with asyncio.TaskGroup() as tasks:
        left = []
        sending.start(tasks, left.append)
        sending.send(BurstOrder(1, 1000, 1000, 0, 0, []))
        await radio.arrivals.get()
        burst, _ = radio.taken[0]
        radio.tell(0, TxOutcome.SENT, 1000)
    assert burst.start == 1000
    assert np.abs(burst.samples) == pytest.approx(
        np.abs(phy.pulse()) * np.abs(burst.samples).max(), abs=1e-3
    )
    assert [each.outcome for each in left] == [Outcome.SENT]
    sending.close()
