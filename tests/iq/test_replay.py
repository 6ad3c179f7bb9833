"""Recordings that are sent again."""

import asyncio
import time

import numpy as np
import pytest

import phy
from backends import Channel, IqFileRadio, LoopbackRadio, RxBlock, Tuning, TxOutcome, TxReport
from phy import PathParams
from sdrlinkd.errors import UserError
from sdrlinkd.iq import Capture, CaptureWish, IqRecording, Replay, plan_replay
from sdrlinkd.iq.testing import AHEAD_S, MOST_AHEAD
from tests.backends.radios import record
from tests.iq.radios import FREQUENCY_HZ, BlockRadio, air, pieces
from tests.iq.recordings import RATE_HZ, write_bursts

TUNING = Tuning(RATE_HZ, FREQUENCY_HZ)
AIR = Channel(PathParams(rate_hz=RATE_HZ))


async def replayed(path, radio, times=1, watch=lambda _, __: None, **wished):
    wished = {"silence_dbfs": None, "backoff_db": None} | wished
    with IqRecording(path) as recording:
        plan = plan_replay(recording, RATE_HZ, **wished, progress=lambda _: None)
        async with Replay(radio, TUNING, recording, plan, times) as replay:
            return await replay.run(lambda state: watch(replay, state))


def found(path):
    """(start of its burst, PDU) for each PDU in a recording."""
    with IqRecording(path) as recording:
        events = [event for event, _ in recording.decode(None, lambda _: None)]
    return [(event.burst.start, event.data) for event in events if isinstance(event, phy.PduHeard)]


def transmitter(path):
    return IqFileRadio(None, path, AIR, 0.001, paced=False, type_name="cf32_le")


@pytest.mark.parametrize("times", [1, 3])
async def test_every_burst_is_sent_at_its_time(tmp_path, times):
    sent = write_bursts(tmp_path / "rec")
    report = await replayed(tmp_path / "rec", transmitter(tmp_path / "sent"), times)
    assert (report.n_bursts, report.sent, report.slipped) == (3 * times, 3 * times, 0)
    assert report.problem == ""
    before, again = found(tmp_path / "rec"), found(tmp_path / "sent")
    assert [pdu for _, pdu in again] == times * sent
    offsets = [b - a for (a, _), (b, _) in zip(times * before, again, strict=True)]
    turns = np.reshape(offsets, (times, -1))
    # The receiver reports the start of a burst to the sample.
    assert np.ptp(turns, axis=1).max() <= 1
    assert np.abs(np.diff(turns[:, 0]) - 80_032).max(initial=0) <= 1


async def test_as_recorded_or_with_the_power_wished(tmp_path):
    samples, length = air([2000], 20_000)
    record(tmp_path / "rec", samples, rate_hz=RATE_HZ)
    for wished, gain in ((None, 1.0), (18, 0.5)):
        radio = BlockRadio(clock(1000), transmits=True, paced=False)
        await replayed(tmp_path / "rec", radio, backoff_db=wished)
        (burst,) = radio.sent
        power = np.mean(np.abs(burst.samples[64 : length - 64]) ** 2)
        assert power == pytest.approx((gain / 4) ** 2, rel=0.06)
        assert burst.latest is None


def clock(n, size=2000):
    """A stream of `n` blocks of 1 ms."""
    return [RxBlock(k * size, size, None, "nothing", 0) for k in range(n)]


async def test_bursts_are_handed_over_some_time_before_theirs(tmp_path):
    starts = [2000 + 30_000 * k for k in range(10)]
    samples, _ = air(starts, 310_000)
    record(tmp_path / "rec", samples, rate_hz=RATE_HZ)
    radio = BlockRadio(clock(1000), transmits=True, paced=False, lead_s=0.02, turnaround_s=0.01)
    ahead = []
    send = radio.send
    first = {}

    async def noted(burst):
        ahead.append(burst.start - radio.end)
        first.setdefault("start", burst.start)
        return await send(burst)

    radio.send = noted
    report = await replayed(tmp_path / "rec", radio)
    assert report.sent == 10
    assert [b.start - first["start"] for b in radio.sent] == pytest.approx(
        [start - 2000 for start in starts], abs=32
    )
    # At least the lead that the radio needs, and never much more.
    assert min(ahead) >= 0.03 * RATE_HZ
    assert max(ahead) <= (0.03 + AHEAD_S) * RATE_HZ


async def test_a_radio_gets_no_more_than_it_has_room_for(tmp_path):
    starts = [1000 * k for k in range(400)]
    samples = np.zeros(400_000, np.complex64)
    for start in starts:
        samples[start : start + 200] = 0.5
    record(tmp_path / "rec", samples, rate_hz=RATE_HZ)
    radio = BlockRadio(clock(1000), transmits=True, paced=False, lead_s=0.5)
    is_full, has = asyncio.Event(), []

    async def held(burst):
        has.append(burst)
        if len(has) == MOST_AHEAD:
            is_full.set()
        await is_full.wait()
        assert len(has) <= MOST_AHEAD
        await asyncio.sleep(0)
        has.remove(burst)
        return TxReport(TxOutcome.SENT, burst.start, burst.start)

    radio.send = held
    report = await replayed(tmp_path / "rec", radio)
    assert report.sent == 400


@pytest.mark.parametrize("outcome", [TxOutcome.LATE, TxOutcome.UNDERFLOW, TxOutcome.LOST])
async def test_what_did_not_leave_is_counted(tmp_path, outcome):
    write_bursts(tmp_path / "rec")
    radio = BlockRadio(clock(1000), transmits=True, paced=False)
    radio.outcome = outcome
    report = await replayed(tmp_path / "rec", radio)
    counts = {
        TxOutcome.LATE: report.late,
        TxOutcome.UNDERFLOW: report.underflow,
        TxOutcome.LOST: report.lost,
    }
    assert counts.pop(outcome) == report.n_bursts == 3
    assert set(counts.values()) == {0}
    assert report.sent == 0


async def test_what_slips_is_told(tmp_path):
    write_bursts(tmp_path / "rec")
    radio = BlockRadio(clock(1000), transmits=True, paced=False)
    send = radio.send

    async def slow(burst):
        report = await send(burst)
        return report._replace(start=report.start + 200)

    radio.send = slow
    report = await replayed(tmp_path / "rec", radio)
    assert (report.sent, report.slipped, report.slip_s) == (3, 3, 1e-4)


async def test_a_stream_that_ends_or_fails_leaves_bursts_behind(tmp_path):
    write_bursts(tmp_path / "rec")
    report = await replayed(tmp_path / "rec", BlockRadio(clock(1), transmits=True))
    assert report.sent < report.n_bursts == 3
    radio = BlockRadio([], fails="the device was stolen", transmits=True)
    report = await replayed(tmp_path / "rec", radio)
    assert (report.sent, report.problem) == (0, "the device was stolen")


async def test_time_goes_on_where_a_radio_hears_nothing_while_it_sends(tmp_path):
    write_bursts(tmp_path / "rec")
    began = RxBlock(0, 2000, None, "nothing", time.monotonic_ns())
    radio = BlockRadio([began], ends=False, transmits=True)
    report = await replayed(tmp_path / "rec", radio)
    assert report.sent == report.n_bursts == 3


async def test_who_stops_sends_no_more(tmp_path):
    write_bursts(tmp_path / "rec")
    radio = BlockRadio([], ends=False, transmits=True)
    report = await replayed(tmp_path / "rec", radio, watch=lambda replay, _: replay.stop())
    assert (report.n_bursts, report.sent, report.late, report.lost) == (3, 0, 0, 0)
    assert not radio.is_open


async def test_radios_that_cannot_send_are_refused(tmp_path):
    write_bursts(tmp_path / "rec")
    with pytest.raises(UserError, match=r"does not send \(made by hand\); allowed: one that does"):
        await replayed(tmp_path / "rec", BlockRadio([]))
    radio = BlockRadio([])
    radio.refuses = "no such device"
    with pytest.raises(UserError, match="no such device"):
        await replayed(tmp_path / "rec", radio)


async def test_a_recording_of_another_rate_is_refused(tmp_path):
    record(tmp_path / "rec", np.ones(100, np.complex64), rate_hz=1_920_000)
    says = r"sampled at 1920000 Hz, but the modem is set to 2000000 Hz; allowed: modem.rate_hz"
    with pytest.raises(UserError, match=says):
        await replayed(tmp_path / "rec", BlockRadio([]))


async def test_what_is_replayed_over_the_air_is_heard_again(tmp_path):
    """One radio sends to itself, and records."""
    sent = write_bursts(tmp_path / "rec", mcs_list=(1, 3))
    radio = LoopbackRadio(AIR, 0.001, paced=False)
    samples = []
    blocks = radio.blocks

    async def heard(hear=None):
        async for block in blocks(hear):
            samples.append(block.samples)
            yield block

    radio.blocks = heard
    report = await replayed(tmp_path / "rec", radio)
    assert report.sent == 2
    listener = BlockRadio(pieces(np.concatenate(samples), 1 << 16))
    wish = CaptureWish(tmp_path / "again", "ci16_le", None, None, phy.OFDM_64_16)
    async with Capture(listener, TUNING, wish) as capture:
        await capture.run(lambda _: None)
    assert [pdu for _, pdu in found(tmp_path / "again")] == sent
