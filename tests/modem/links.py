"""Modems on a loopback, with a link that hands out bursts and records its calls."""

import asyncio
import contextlib
from collections import deque
from random import Random

from backends import LoopbackParams
from sdrlinkd.config import (
    ChannelParams,
    Config,
    ModemParams,
)
from sdrlinkd.link import Burst, LinkParams, Qos
from sdrlinkd.modem import make_modem

SIZE = 64
# Four PDUs fit, by the MCS of the bursts here.
LONGEST_S = 0.01


class Listener:
    """Hands out bursts in order, and records its calls."""

    def __init__(self):
        self.queue, self.asked, self.taken = deque(), [], []
        self.pdus, self.settled_bursts = [], []
        self.moved = asyncio.Event()
        self.now = float

    def attach(self, traits):
        self.traits = traits

    def heard(self, pdus):
        self.pdus += pdus
        self.moved.set()

    def advance(self, now):
        raise AssertionError("only in lock-step does the modem drive the clock")

    def next_wakeup(self, now):
        return now if self.queue else float("inf")

    def next_burst(self, opportunity):
        self.asked.append((self.now(), opportunity))
        if not self.queue:
            return None
        burst = self.queue.popleft()._replace(start=opportunity.earliest)
        self.taken.append(burst)
        self.moved.set()
        return burst

    def settled(self, burst, outcome, at):
        self.settled_bursts.append((burst, outcome, at))
        self.moved.set()

    async def until(self, condition):
        while not condition():
            self.moved.clear()
            await self.moved.wait()


def send(modem, listener, bursts):
    listener.queue += bursts
    modem.wake()


@contextlib.asynccontextmanager
async def running(config):
    modem, listener = make_modem(config, 1, Random(1)), Listener()
    listener.now = modem.now
    async with contextlib.AsyncExitStack() as stack:
        stack.push_async_callback(modem.close)
        carry = await modem.open(listener)
        task = asyncio.ensure_future(carry())
        try:
            yield modem, listener
        finally:
            await modem.close()
            task.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await task


def config(paced, **more):
    return Config(
        backend="loopback",
        link=LinkParams(pdu_size=SIZE),
        loopback=LoopbackParams(paced=paced),
        channel=more.pop("channel", ChannelParams(snr_db=15, clock_ppm=10)),
        modem=ModemParams(**{"rate_hz": 1e6, "max_cfo_hz": 1e5, "max_burst_s": LONGEST_S, **more}),
    )


def bursts(seed, n):
    rng = Random(seed)
    for _ in range(n):
        pdus = [rng.randbytes(SIZE) for _ in range(rng.randint(1, 4))]
        yield Burst(pdus, [[] for _ in pdus], [Qos.DEFAULT for _ in pdus])
