"""The modem over a real loopback radio, in this process."""

import asyncio
import contextlib
from random import Random

import pytest

from sdrlinkd.config import (
    ChannelParams,
    Config,
    IqFileParams,
    LoopbackParams,
    ModemParams,
)
from sdrlinkd.errors import UserError
from sdrlinkd.link import Burst, LinkParams, Outcome, ReassemblyParams
from sdrlinkd.modem import make_modem

SIZE = 64


class Listener:
    """Keeps what it is told."""

    def __init__(self):
        self.pdus, self.settled_bursts = [], []
        self.moved = asyncio.Event()

    def heard(self, pdus):
        self.pdus += pdus
        self.moved.set()

    def settled(self, burst, outcome, at):
        self.settled_bursts.append((burst, outcome, at))
        self.moved.set()

    async def until(self, condition):
        while not condition():
            self.moved.clear()
            await self.moved.wait()


@contextlib.asynccontextmanager
async def running(config):
    modem, listener = make_modem(config, Random(1)), Listener()
    await modem.open(listener)
    task = asyncio.ensure_future(modem.run())
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
        modem=ModemParams(**{"rate_hz": 1e6, "max_cfo_hz": 1e5, **more}),
    )


def bursts(seed, n):
    rng = Random(seed)
    for _ in range(n):
        pdus = [rng.randbytes(SIZE) for _ in range(rng.randint(1, 4))]
        yield Burst(pdus, [[] for _ in pdus])


@pytest.mark.parametrize("paced", [True, False])
async def test_every_pdu_comes_back_and_every_burst_is_settled(paced):
    sent = list(bursts(3, 12))
    async with running(config(paced)) as (modem, listener):
        for burst in sent:
            opportunity = await modem.opportunity()
            assert opportunity.start >= modem.now() - 1e-9 or not paced
            assert len(burst.pdus) <= opportunity.max_pdus
            modem.send(burst)
        await modem.idle()
        pdus = [pdu for burst in sent for pdu in burst.pdus]
        await listener.until(lambda: len(listener.pdus) == len(pdus))
        assert [heard.data for heard in listener.pdus] == pdus
        assert [burst for burst, _, _ in listener.settled_bursts] == sent
        assert {outcome for _, outcome, _ in listener.settled_bursts} == {Outcome.SENT}
        for heard in listener.pdus:
            assert 10 < heard.snr_db < 20
            assert 0 <= heard.at <= modem.now()
        report = modem.report()
        assert (report.state, report.kind, report.notices) == ("up", "loopback", [])
        assert report.counters["pdus_good"] == len(pdus)
        assert report.realtime_ratio > 0


async def test_the_next_burst_is_asked_for_only_when_the_one_before_is_nearly_out():
    async with running(config(True)) as (modem, _):
        last_end = 0.0
        for burst in bursts(5, 6):
            opportunity = await modem.opportunity()
            assert opportunity.start >= last_end
            assert opportunity.start - modem.now() < 0.005 + 0.001 + 0.001
            modem.send(burst)
            n_symbols = -(-len(burst.pdus) * 1100 // 96)
            last_end = opportunity.start + (512 + 80 * n_symbols) / 1e6


async def test_closing_settles_what_has_not_left():
    async with running(config(True)) as (modem, listener):
        await modem.opportunity()
        (burst,) = bursts(6, 1)
        modem.send(burst)
        await modem.close()
        assert [outcome for _, outcome, _ in listener.settled_bursts] == [Outcome.LOST]
        await modem.idle()
        await modem.close()
        assert modem.report().state == "down"


async def test_without_hear_self_nothing_is_heard():
    deaf = Config(
        backend="loopback",
        link=LinkParams(pdu_size=SIZE),
        loopback=LoopbackParams(paced=False, hear_self=False),
        modem=ModemParams(rate_hz=1e6),
    )
    async with running(deaf) as (modem, listener):
        for burst in bursts(2, 3):
            await modem.opportunity()
            modem.send(burst)
        await modem.idle()
        assert len(listener.settled_bursts) == 3
        assert listener.pdus == []


async def test_a_recording_is_written_and_played(tmp_path):
    recording = str(tmp_path / "rec")
    link = LinkParams(pdu_size=SIZE)
    sent = list(bursts(9, 5))
    modem = ModemParams(rate_hz=1e6)
    writing = Config(
        backend="iqfile", link=link, modem=modem, channel=ChannelParams(clock_ppm=5),
        iqfile=IqFileParams(transmit=recording, format="ci8", paced=False),
    )  # fmt: skip
    async with running(writing) as (link_out, listener):
        for burst in sent:
            await link_out.opportunity()
            link_out.send(burst)
        await link_out.idle()
        assert {outcome for _, outcome, _ in listener.settled_bursts} == {Outcome.SENT}
    playing = Config(
        backend="iqfile", link=link, modem=modem, channel=ChannelParams(snr_db=15),
        iqfile=IqFileParams(receive=recording, paced=False),
    )  # fmt: skip
    async with running(playing) as (link_in, listener):
        pdus = [pdu for burst in sent for pdu in burst.pdus]
        await listener.until(lambda: len(listener.pdus) == len(pdus))
        assert [heard.data for heard in listener.pdus] == pdus
        assert "only receives" in " ".join(link_in.report().notices)


def test_what_cannot_be_is_refused_in_words(tmp_path):
    slow = Config(
        backend="loopback",
        modem=ModemParams(rate_hz=1e4, mcs=0, max_cfo_hz=1e3),
        link=LinkParams(pdu_size=2047),
    )
    with pytest.raises(UserError, match=r"modem.rate_hz: got 10000; a PDU of 2047 B takes 5.5 s"):
        make_modem(slow, Random(1))
    fast = Config(
        backend="loopback",
        modem=ModemParams(rate_hz=1e4, mcs=6, max_cfo_hz=1e3),
        link=LinkParams(pdu_size=64),
        reassembly=ReassemblyParams(timeout_s=1.0),
    )
    make_modem(fast, Random(1))


@pytest.mark.parametrize(
    ("files", "says"),
    [
        ({}, "no such recording"),
        ({"rec.sigmf-meta": "{"}, "not SigMF metadata"),
        ({"rec.sigmf-meta": '{"global": {"core:datatype": "rf32_le"}}', "rec.sigmf-data": ""},
         "allowed: cf32_le, ci16_le, ci8"),
        ({"rec.sigmf-meta": '{"global": {"core:datatype": "ci8", "core:sample_rate": 2e6}}',
          "rec.sigmf-data": "ab"}, "is sampled at 2e+06 Hz; the modem is set to 1e+06 Hz"),
    ],
)  # fmt: skip
async def test_a_recording_that_cannot_be_played_is_refused_in_words(tmp_path, files, says):
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    wanted = Config(
        backend="iqfile",
        modem=ModemParams(rate_hz=1e6),
        iqfile=IqFileParams(receive=str(tmp_path / "rec")),
    )
    modem = make_modem(wanted, Random(1))
    with pytest.raises(UserError) as error:
        await modem.open(Listener())
    assert says in str(error.value)
    assert "\n" not in str(error.value)
    await modem.close()
