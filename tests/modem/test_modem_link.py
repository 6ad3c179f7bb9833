"""The modem over a real loopback radio, in this process."""

import asyncio
from random import Random

import pytest

import phy
from backends import IqFileParams, LoopbackParams
from sdrlinkd.config import (
    ChannelParams,
    Config,
    ModemParams,
)
from sdrlinkd.errors import UserError
from sdrlinkd.link import LinkParams, Outcome, ReassemblyParams
from sdrlinkd.modem import make_modem
from sdrlinkd.modem.testing import HANDOVER_S
from tests.modem.links import LONGEST_S, SIZE, Listener, bursts, config, running, send
from tests.waiting import wait_for


@pytest.mark.slow
@pytest.mark.parametrize("paced", [True, False])
async def test_every_pdu_comes_back_and_every_burst_is_settled(paced):
    sent = list(bursts(3, 12))
    async with running(config(paced)) as (modem, listener):
        send(modem, listener, sent)
        await listener.until(lambda: len(listener.settled_bursts) == len(sent))
        await modem.idle()
        pdus = [pdu for burst in sent for pdu in burst.pdus]
        await listener.until(lambda: len(listener.pdus) == len(pdus))
        assert [heard.data for heard in listener.pdus] == pdus
        settled = [burst._replace(start=0.0) for burst, _, _ in listener.settled_bursts]
        assert settled == [burst._replace(start=0.0) for burst in listener.taken]
        assert {outcome for _, outcome, _ in listener.settled_bursts} == {Outcome.SENT}
        for heard in listener.pdus:
            assert 10 < heard.snr_db < 20
            assert 0 <= heard.at <= modem.now()
        starts = [burst.start for burst in listener.taken for _ in burst.pdus]
        for heard, start in zip(listener.pdus, starts, strict=True):
            # Later if the radio could not start sooner, but never earlier.
            assert heard.at > start - 5e-6
        report = modem.report()
        assert (report.state, report.kind, report.notices) == ("up", "loopback", [])
        assert report.counters["pdus_good"] == len(pdus)
        # It is told twice a second.
        await asyncio.to_thread(wait_for, lambda: modem.report().realtime_ratio)


async def test_each_burst_leaves_with_its_own_mcs():
    sent = [burst._replace(mcs=mcs) for mcs, burst in enumerate(bursts(4, 7))]
    async with running(config(False, channel=ChannelParams(snr_db=35))) as (modem, listener):
        send(modem, listener, sent)
        await listener.until(lambda: len(listener.settled_bursts) == len(sent))
        n_pdus = sum(len(burst.pdus) for burst in sent)
        await listener.until(lambda: len(listener.pdus) == n_pdus)
        heard_at = {heard.data: heard.at for heard in listener.pdus}
        for burst, _, end in listener.settled_bursts:
            samples = phy.layout(phy.OFDM_64_16, burst.mcs, len(burst.pdus), SIZE).n_samples
            assert end - heard_at[burst.pdus[0]] == pytest.approx(samples / 1e6, abs=5e-6)


@pytest.mark.parametrize(("rate_hz", "ppm"), [(5e6, 80), (5e6, -80), (1e6, 40), (1e6, -40)])
async def test_by_default_radios_hear_each_other_however_far_their_crystals_are_off(rate_hz, ppm):
    """At 5.9 GHz, where 40 ppm are 236 kHz; only the frequency is set."""
    sent = list(bursts(7, 4))
    air = Config(
        backend="loopback",
        link=LinkParams(pdu_size=SIZE),
        loopback=LoopbackParams(paced=False),
        channel=ChannelParams(snr_db=15, clock_ppm=ppm),
        modem=ModemParams(rate_hz=rate_hz, frequency_hz=5.9e9, max_burst_s=LONGEST_S),
    )
    async with running(air) as (modem, listener):
        send(modem, listener, sent)
        pdus = [pdu for burst in sent for pdu in burst.pdus]
        await listener.until(lambda: len(listener.settled_bursts) == len(sent))
        await listener.until(lambda: len(listener.pdus) == len(pdus))
        assert [heard.data for heard in listener.pdus] == pdus
        assert modem.report().max_cfo_hz == min(472e3, rate_hz / 4)


@pytest.mark.slow
async def test_the_next_burst_is_asked_for_only_when_the_one_before_is_nearly_out():
    async with running(config(True)) as (modem, listener):
        send(modem, listener, bursts(5, 6))
        await listener.until(lambda: len(listener.settled_bursts) == 6)
        last_end = 0.0
        for (now, opportunity), burst in zip(listener.asked, listener.taken, strict=True):
            assert opportunity.earliest >= last_end
            assert opportunity.earliest - now < 0.005 + 0.001 + 0.001
            last_end = opportunity.earliest + opportunity.airtime_s(burst.mcs, len(burst.pdus))


async def test_nobody_is_asked_while_there_is_nothing_to_send():
    async with running(config(False)) as (modem, listener):
        for n in range(1, 4):
            for _ in range(20):
                modem.wake()
                await asyncio.sleep(0)
            assert len(listener.asked) == n - 1
            send(modem, listener, bursts(8, 1))
            await listener.until(lambda n=n: len(listener.settled_bursts) == n)


@pytest.mark.slow
async def test_a_carrier_tells_what_it_is():
    async with running(config(True, mcs=3)) as (modem, listener):
        traits = listener.traits
        assert (traits.kind, traits.mcs, traits.is_lockstep) == ("loopback", 3, False)
        assert (traits.senses, traits.transmits) == (True, True)
        assert traits.lead_s == pytest.approx(HANDOVER_S)
        assert traits.react_s > ModemParams().block_s
        assert traits.detect_s == 2 * phy.SENSE_WINDOW / 1e6
        assert len(traits.needed_snr_db) == len(traits.longest_burst_s) == len(phy.MCS_TABLE)
        assert list(traits.needed_snr_db) == sorted(traits.needed_snr_db)
        assert modem.now() >= 0


@pytest.mark.slow
async def test_closing_settles_what_has_not_left():
    async with running(config(True)) as (modem, listener):
        send(modem, listener, bursts(6, 1))
        await listener.until(lambda: listener.taken)
        await modem.close()
        assert [outcome for _, outcome, _ in listener.settled_bursts] == [Outcome.LOST]
        await modem.idle()
        await modem.close()
        assert modem.report().state == "ended"


async def test_without_hear_self_nothing_is_heard():
    deaf = Config(
        backend="loopback",
        link=LinkParams(pdu_size=SIZE),
        loopback=LoopbackParams(paced=False, hear_self=False),
        modem=ModemParams(rate_hz=1e6, max_burst_s=LONGEST_S),
    )
    async with running(deaf) as (modem, listener):
        send(modem, listener, bursts(2, 3))
        await listener.until(lambda: len(listener.settled_bursts) == 3)
        assert listener.pdus == []


async def test_a_recording_is_written_and_played(tmp_path):
    recording = str(tmp_path / "rec")
    link = LinkParams(pdu_size=SIZE)
    sent = list(bursts(9, 5))
    modem = ModemParams(rate_hz=1e6, max_burst_s=LONGEST_S)
    writing = Config(
        backend="iqfile", link=link, modem=modem, channel=ChannelParams(clock_ppm=5),
        iqfile=IqFileParams(transmit=recording, format="ci8", paced=False),
    )  # fmt: skip
    async with running(writing) as (link_out, listener):
        send(link_out, listener, sent)
        await listener.until(lambda: len(listener.settled_bursts) == len(sent))
        assert {outcome for _, outcome, _ in listener.settled_bursts} == {Outcome.SENT}
    playing = Config(
        backend="iqfile", link=link, modem=modem, channel=ChannelParams(snr_db=15),
        iqfile=IqFileParams(receive=recording, paced=False),
    )  # fmt: skip
    async with running(playing) as (link_in, listener):
        send(link_in, listener, bursts(10, 1))
        pdus = [pdu for burst in sent for pdu in burst.pdus]
        await listener.until(lambda: len(listener.pdus) == len(pdus))
        assert [heard.data for heard in listener.pdus] == pdus
        assert "only receives" in " ".join(link_in.report().notices)
        assert listener.asked == []


def test_what_cannot_be_is_refused_in_words(tmp_path):
    slow = Config(
        backend="loopback",
        modem=ModemParams(rate_hz=1e4, mcs=0, max_cfo_hz=1e3),
        link=LinkParams(pdu_size=2047),
    )
    with pytest.raises(UserError, match=r"modem.rate_hz: got 10000; a PDU of 2047 B takes 5.5 s"):
        make_modem(slow, 1, Random(1))
    fast = Config(
        backend="loopback",
        modem=ModemParams(rate_hz=1e4, mcs=6, max_cfo_hz=1e3),
        link=LinkParams(pdu_size=64),
        reassembly=ReassemblyParams(timeout_s=1.0),
    )
    make_modem(fast, 1, Random(1))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("files", "says"),
    [
        ({}, "no such recording"),
        ({"rec.sigmf-meta": "{"}, "not SigMF metadata"),
        ({"rec.sigmf-meta": '{"global": {"core:datatype": "rf32_le"}}', "rec.sigmf-data": ""},
         "allowed: cf32_le, ci16_le, ci8"),
        ({"rec.sigmf-meta": '{"global": {"core:datatype": "ci8", "core:sample_rate": 2e6}}',
          "rec.sigmf-data": "ab"}, "sampled at 2e+06 Hz, but the modem is set to 1e+06 Hz"),
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
    modem = make_modem(wanted, 1, Random(1))
    with pytest.raises(UserError) as error:
        await modem.open(Listener())
    assert says in str(error.value)
    assert "\n" not in str(error.value)
    await modem.close()
