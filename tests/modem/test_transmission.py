"""Bursts on their way to a radio: none overtakes a late one."""

import asyncio

import pytest

import phy
from backends import Capabilities, TxOutcome, TxReport
from sdrlinkd.config import ModemParams
from sdrlinkd.link import Burst, Outcome, Qos
from sdrlinkd.modem.transmission import Transmission


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


LONG_S = 1.0


def made(number, latest=1.0, airtime_s=0.0):
    pdus, classes = [bytes([number]) * 32], [Qos.DEFAULT]
    return Burst(pdus, [[]], classes, start=0.5, latest=latest, number=number, airtime_s=airtime_s)


@pytest.mark.parametrize("lockstep", [False, True], ids=["in-a-thread", "here"])
@pytest.mark.parametrize("composed", ["before", "between"])
async def test_what_was_composed_before_a_late_one_was_known_goes_back_too(lockstep, composed):
    """The radio has reported, but no task has been woken up yet."""
    radio, left, settled = Radio(lockstep), [], asyncio.Event()

    def note(burst, report):
        left.append((burst.number, report.outcome))
        if len(left) == 2:
            settled.set()

    async with asyncio.TaskGroup() as tasks, asyncio.timeout(60):
        transmission = Transmission(ModemParams(rate_hz=1e6), radio)
        await asyncio.to_thread(phy.warm_up)
        transmission.start(tasks, note)
        transmission.send(made(1), 500_000)
        await radio.arrivals.get()
        if composed == "before" and not lockstep:
            transmission.send(made(2, airtime_s=LONG_S), 510_000)
        radio.tell(0, TxOutcome.LATE, 500_000)
        if composed == "between" or lockstep:
            transmission.send(made(2, airtime_s=LONG_S), 510_000)
        await settled.wait()
        assert left == [(1, Outcome.LATE), (2, Outcome.LATE)]
        assert len(radio.taken) == 1
        transmission.send(made(1), 520_000)
        await radio.arrivals.get()
        radio.tell(1, TxOutcome.SENT, 520_000)
    assert left[2:] == [(1, Outcome.SENT)]
    transmission.close()


async def test_what_may_leave_whenever_it_can_does_not_wait_for_a_late_one():
    radio, left = Radio(lockstep=True), []
    async with asyncio.TaskGroup() as tasks, asyncio.timeout(60):
        transmission = Transmission(ModemParams(rate_hz=1e6), radio)
        await asyncio.to_thread(phy.warm_up)
        transmission.start(tasks, lambda burst, report: left.append(report.outcome))
        transmission.send(made(1), 500_000)
        radio.tell(0, TxOutcome.LATE, 500_000)
        transmission.send(made(2, latest=float("inf")), 510_000)
        radio.tell(1, TxOutcome.SENT, 510_000)
    assert left == [Outcome.LATE, Outcome.SENT]
    assert radio.taken[0][0].latest == 1_000_000
    assert radio.taken[1][0].latest is None
    transmission.close()


async def test_a_short_burst_does_not_overtake_a_long_one():
    """Short bursts are modulated where they are composed, long ones in a thread."""
    radio = Radio(lockstep=False)
    async with asyncio.TaskGroup() as tasks, asyncio.timeout(60):
        transmission = Transmission(ModemParams(rate_hz=1e6), radio)
        await asyncio.to_thread(phy.warm_up)
        transmission.start(tasks, lambda *_: None)
        transmission.send(made(1), 100)
        assert len(radio.taken) == 1
        for number, airtime_s in ((2, LONG_S), (3, 0.0), (4, 0.0)):
            transmission.send(made(number, airtime_s=airtime_s), 1000 * number)
        assert len(radio.taken) == 1
        for _ in range(4):
            await radio.arrivals.get()
        assert [burst.start for burst, _ in radio.taken] == [100, 2000, 3000, 4000]
        for number in range(4):
            radio.tell(number, TxOutcome.SENT, 0)
    transmission.close()
