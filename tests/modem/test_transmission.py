"""Bursts on their way to a radio: none overtakes one that was late."""

import asyncio

import pytest

from backends import Capabilities, TxOutcome, TxReport
from sdrlinkd.config import ModemParams
from sdrlinkd.link import Burst, Outcome, Qos
from sdrlinkd.modem.transmission import Transmission


class Radio:
    """Takes bursts and says nothing until told to."""

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


def made(number, latest=1.0):
    return Burst(
        [bytes([number]) * 32], [[]], [Qos.DEFAULT], start=0.5, latest=latest, number=number
    )


@pytest.mark.parametrize("lockstep", [False, True], ids=["in-a-thread", "here"])
@pytest.mark.parametrize("composed", ["before", "between"])
async def test_what_was_composed_before_a_late_one_was_known_goes_back_too(lockstep, composed):
    """The radio has told, but nobody has been woken by that yet."""
    radio, left, settled = Radio(lockstep), [], asyncio.Event()

    def note(burst, report):
        left.append((burst.number, report.outcome))
        if len(left) == 2:
            settled.set()

    async with asyncio.TaskGroup() as tasks, asyncio.timeout(60):
        transmission = Transmission(ModemParams(rate_hz=1e6), radio)
        await transmission.warm_up()
        transmission.start(tasks, note)
        transmission.send(made(1), 500_000)
        await radio.arrivals.get()
        if composed == "before" and not lockstep:
            transmission.send(made(2), 510_000)
        radio.tell(0, TxOutcome.LATE, 500_000)
        if composed == "between" or lockstep:
            transmission.send(made(2), 510_000)
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
        await transmission.warm_up()
        transmission.start(tasks, lambda burst, report: left.append(report.outcome))
        transmission.send(made(1), 500_000)
        radio.tell(0, TxOutcome.LATE, 500_000)
        transmission.send(made(2, latest=float("inf")), 510_000)
        radio.tell(1, TxOutcome.SENT, 510_000)
    assert left == [Outcome.LATE, Outcome.SENT]
    assert radio.taken[0][0].latest == 1_000_000
    assert radio.taken[1][0].latest is None
    transmission.close()
