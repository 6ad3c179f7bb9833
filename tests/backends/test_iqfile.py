"""A radio that is a recording: what it plays and records, and files that it rejects."""

import asyncio
import time

import numpy as np
import pytest

from backends import (
    BackendError,
    Channel,
    IqFileRadio,
    LoopbackRadio,
    Tuning,
    TxBurst,
    TxOutcome,
    describe,
)
from backends.testing import MAX_WAITING
from phy import PROFILES, FrontEndParams, PathParams, warm_up
from tests.backends.radios import (
    AIR,
    BLOCK_S,
    RATE,
    TUNING,
    N,
    bursts,
    hand_over,
    heard,
    noise,
    opened,
    read,
    record,
    send,
    stream,
    take,
    turn,
)


def player(path, channel=AIR, paced=False, **settings):
    return IqFileRadio(path, None, channel, BLOCK_S, paced, **settings)


def transmitter(path, channel=AIR, block_s=BLOCK_S, type_name="cf32_le"):
    return IqFileRadio(None, path, channel, block_s, paced=False, type_name=type_name)


def both(receive, transmit):
    return IqFileRadio(receive, transmit, AIR, BLOCK_S, paced=False, type_name="cf32_le")


@pytest.mark.parametrize(
    ("type_name", "step"), [("cf32_le", 0), ("ci16_le", 2**-15), ("ci8", 2**-7)]
)
async def test_what_one_records_another_receives(tmp_path, type_name, step):
    wanted = bursts(6)
    radio = transmitter(tmp_path / "x", type_name=type_name)
    async with opened(radio):
        reports, _ = await send(radio, radio.blocks(), wanted)
        assert not radio.counters["clipped"]
    received = await stream(player(tmp_path / "x"))
    for burst, report in zip(wanted, reports, strict=True):
        got = received[report.start : report.end]
        assert np.abs(np.abs(got) - np.abs(burst.samples)).max() <= step + 1e-6
        received[report.start : report.end] = 0
    assert not received.any()


async def sent_into_one_block(radio, wanted):
    """(reports, the block that contains all bursts)."""
    async with opened(radio):
        reports, (block,) = await send(radio, radio.blocks(), wanted)
    return reports, block


@pytest.mark.parametrize("profile", PROFILES)
async def test_a_recording_holds_what_a_loopback_hears(tmp_path, profile):
    warm_up()
    path = PathParams(
        rate_hz=RATE, profile=profile, delay_s=33e-6, clock_ppm=20, centre_hz=1e9, loss_db=3
    )
    channel, wanted = Channel(path, seed=8), [TxBurst(0, noise(500)), TxBurst(1000, noise(700))]
    loopback = LoopbackRadio(channel, 0.05, paced=False)
    reports, block = await sent_into_one_block(loopback, wanted)
    same, _ = await sent_into_one_block(transmitter(tmp_path / "x", channel, 0.05), wanted)
    assert same == reports
    recorded = read(tmp_path / "x")[: block.n]
    assert np.count_nonzero(recorded) > 1200
    assert np.array_equal(recorded, block.samples)


async def test_echoes_of_two_bursts_add_up_in_a_recording(tmp_path):
    path = PathParams(rate_hz=RATE, profile="tdl-c", delay_spread_s=6 / RATE)
    channel, wanted = Channel(path, seed=3), [TxBurst(0, noise(500)), TxBurst(0, noise(500))]
    loopback = LoopbackRadio(channel, 0.05, paced=False)
    _, block = await sent_into_one_block(loopback, wanted)
    await sent_into_one_block(transmitter(tmp_path / "x", channel, 0.05), wanted)
    assert np.abs(read(tmp_path / "x")[: block.n] - block.samples).max() < 1e-5


async def test_no_burst_begins_so_early_that_what_echoes_put_before_it_is_cut(tmp_path):
    channel = Channel(PathParams(rate_hz=RATE, profile="tdl-a"), seed=1)
    radio = transmitter(tmp_path / "x", channel)
    async with opened(radio):
        reports, _ = await send(radio, radio.blocks(), [TxBurst(0, noise(100))])
    offset, samples = channel.make_path().carry(noise(100))
    assert reports[0].start == -offset > 0
    assert np.array_equal(read(tmp_path / "x")[: len(samples)], samples)


async def test_noise_is_added_to_what_is_played(tmp_path):
    record(tmp_path / "x", noise(50_000))
    data = (tmp_path / "x.sigmf-data").read_bytes()
    channel = Channel(PathParams(rate_hz=RATE), FrontEndParams(noise_dbfs=-30), 1)
    received = await stream(player(tmp_path / "x", channel))
    power_db = 10 * np.log10(np.mean(np.abs(received - noise(50_000)) ** 2))
    assert power_db == pytest.approx(-30, abs=0.1)
    assert (tmp_path / "x.sigmf-data").read_bytes() == data


async def test_a_recording_is_played_in_real_time(tmp_path):
    record(tmp_path / "x", noise(20_000))
    began = time.monotonic()
    await stream(player(tmp_path / "x", paced=True))
    assert time.monotonic() - began > 0.198


async def test_a_bare_file_is_played_as_the_type_it_is_said_to_be(tmp_path):
    path = tmp_path / "bare.bin"
    path.write_bytes(bytes(range(200)))
    received = await stream(player(path, receive_type="cu8"))
    assert np.array_equal(received, read(path, "cu8"))
    with pytest.raises(BackendError, match="unknown sample type"):
        await stream(player(path))


async def test_a_recording_of_another_rate_is_not_played(tmp_path):
    record(tmp_path / "x", noise(100))
    with pytest.raises(BackendError) as error:
        async with opened(player(tmp_path / "x"), Tuning(2 * RATE, 0)):
            pass
    wanted = "x.sigmf-data: sampled at 100000 Hz, but the modem is set to 200000 Hz"
    assert str(error.value).endswith(wanted)
    # An oscillator's error does not count as another rate.
    async with opened(player(tmp_path / "x"), Tuning(RATE * (1 + 5e-7), 0)):
        pass


async def test_a_recording_that_is_not_there_is_not_opened(tmp_path):
    with pytest.raises(BackendError, match="none: no such recording"):
        await stream(player(tmp_path / "none"))
    assert not list(tmp_path.iterdir())


async def test_the_detail_names_the_files_and_what_is_wrong_with_them(tmp_path):
    record(tmp_path / "x", noise(100))
    with (tmp_path / "x.sigmf-data").open("ab") as data:
        data.write(b"abc")
    radio = both(tmp_path / "x", tmp_path / "y")
    assert radio.detail == f"from {tmp_path / 'x'}, to {tmp_path / 'y'}"
    received = await stream(radio)
    assert len(received) == 100
    assert "x.sigmf-data: ends with 3 bytes, less than a cf32_le sample" in radio.detail


async def test_a_recording_lasts_until_the_radio_is_closed(tmp_path):
    radio = transmitter(tmp_path / "x")
    async with opened(radio):
        await take(radio.blocks(), 10 * N)
    info = describe(tmp_path / "x")
    # Waiting blocks count; one is being made, and one more while the radio is closed.
    assert 10 * N <= info.n_samples <= (10 + MAX_WAITING + 2) * N
    assert (info.rate_hz, info.frequency_hz) == (TUNING.rate_hz, TUNING.frequency_hz)
    assert not read(tmp_path / "x").any()


async def test_bursts_that_end_behind_the_recording_played_are_lost_with_its_end(tmp_path):
    record(tmp_path / "x", noise(1000))
    radio = both(tmp_path / "x", tmp_path / "y")
    wanted = [TxBurst(100, noise(100)), TxBurst(900, noise(100)), TxBurst(1000, noise(1))]
    wanted += [TxBurst(5000, noise(1))]
    async with opened(radio):
        sends = await hand_over(radio, wanted)
        assert len(heard(await take(radio.blocks()))) == 1000
        await turn()
        assert all(each.done() for each in sends)
        outcomes = [(await each).outcome for each in sends]
    assert outcomes == [TxOutcome.SENT, TxOutcome.SENT, TxOutcome.LOST, TxOutcome.LOST]
    assert len(read(tmp_path / "y")) == 1000


async def test_a_burst_given_after_the_end_of_the_recording_is_lost_at_once(tmp_path):
    record(tmp_path / "x", noise(1000))
    radio = both(tmp_path / "x", tmp_path / "y")
    async with opened(radio):
        await take(radio.blocks())
        report = await asyncio.wait_for(radio.send(TxBurst(0, noise(10))), 0.5)
        assert report.outcome is TxOutcome.LOST


async def test_a_recording_is_not_written_over_while_it_is_played(tmp_path):
    record(tmp_path / "x", noise(1000))
    with pytest.raises(BackendError, match="x"):
        await stream(both(tmp_path / "x", tmp_path / "x.sigmf-data"))
    assert np.array_equal(read(tmp_path / "x"), noise(1000))
