"""From radios into recordings, with annotations of what was received."""

import json
import re
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest
import sigmf

import phy
from backends import Channel, IqFileRadio, Tuning, describe
from phy import PathParams
from sdrlinkd.errors import UserError
from sdrlinkd.iq import Capture, CaptureWish, IqRecording
from sdrlinkd.iq.testing import CONSTANTS, BurstFinder
from tests.iq.radios import FREQUENCY_HZ, BlockRadio, air, gap, pieces
from tests.iq.recordings import RATE_HZ, write_bursts

GRID = phy.OFDM_64_16
TUNING = Tuning(RATE_HZ, FREQUENCY_HZ)


def wish(path, seconds=None, network=None, type_name="ci16_le"):
    return CaptureWish(path, type_name, seconds, network, GRID)


async def captured(radio, wanted, watch=lambda _: None):
    async with Capture(radio, TUNING, wanted) as capture:
        report = await capture.run(watch)
    assert not getattr(radio, "is_open", False)
    return report


def metadata(path):
    """Metadata as read by SigMF's package, which must find it valid."""
    theirs = sigmf.fromfile(f"{path}.sigmf-meta")
    theirs.validate()
    meta = json.loads(path.with_suffix(".sigmf-meta").read_text())
    sigmf.validate.validate(meta)
    return meta


def bursts(meta):
    return [each for each in meta["annotations"] if "burst" in each["core:label"]]


def pdus(path, network=None):
    with IqRecording(path) as recording:
        events = [event for event, _ in recording.decode(network, lambda _: None)]
    return [event.data for event in events if isinstance(event, phy.PduHeard)]


@pytest.mark.parametrize("type_name", ["cf32_le", "ci16_le", "ci8"])
async def test_every_burst_of_a_recording_that_is_a_radio_is_annotated(tmp_path, type_name):
    sent = write_bursts(tmp_path / "played")
    channel = Channel(PathParams(rate_hz=RATE_HZ))
    radio = IqFileRadio(tmp_path / "played", None, channel, 0.001, paced=False)
    report = await captured(radio, wish(tmp_path / "rec", type_name=type_name))
    assert (report.n_samples, report.seconds, report.problem) == (80_000, 0.04, "")
    assert (report.n_bursts, report.pdus_good, report.pdus_bad) == (3, 6, 0)
    assert report.searched_s == report.seconds
    assert pdus(tmp_path / "rec") == sent
    meta = metadata(tmp_path / "rec")
    assert meta["global"]["core:hw"] == f"from {tmp_path}/played"
    assert [each["core:label"] for each in meta["annotations"]] == ["burst"] * 3
    for k, (mcs, each) in enumerate(zip((1, 3, 6), meta["annotations"], strict=True)):
        assert abs(each["core:sample_start"] - 20_000 * k - 5000) <= 2
        assert each["core:sample_count"] == phy.layout(GRID, mcs, 2, 64).n_samples
        said = each["core:comment"]
        assert said.startswith(f"{phy.MCS_TABLE[mcs].name}, PDUs of 64 B: 2 good, 0 bad, SNR 2")
        assert re.search(r"dB, CFO \+19[56]\d\d Hz, EVM -\S+ dB, \S+ dBFS, network 2$", said)
        low, high = each["core:freq_lower_edge"], each["core:freq_upper_edge"]
        assert (low + high) / 2 - FREQUENCY_HZ == pytest.approx(8e-6 * FREQUENCY_HZ, abs=100)
        assert high - low == pytest.approx(53 / 64 * RATE_HZ)


async def test_what_is_recorded_is_what_was_received(tmp_path):
    samples, _ = air([3000], 9_000)
    for size in (100, 1777):
        radio = BlockRadio(pieces(samples, size, first=400))
        await captured(radio, wish(tmp_path / "rec", type_name="cf32_le"))
        with IqRecording(tmp_path / "rec") as recording:
            assert np.array_equal(recording.read(0, 10_000), samples)


async def test_a_gap_is_silent_and_told_and_a_capture_begins_behind_it(tmp_path):
    samples, length = air([2000, 20_000], 30_000)
    blocks = [gap(0, 700), *pieces(samples[:8000], 500, 700), gap(8700, 4000)]
    blocks += [*pieces(samples[12_000:20_600], 500, 12_700), gap(21_300, 50)]
    blocks += pieces(samples[20_650:], 500, 21_350)
    began = datetime.now(UTC)
    report = await captured(BlockRadio(blocks), wish(tmp_path / "rec"))
    assert (report.n_samples, report.n_gaps, report.samples_lost) == (30_000, 2, 4050)
    assert (report.n_bursts, report.pdus_good, report.pdus_bad) == (2, 1, 0)
    meta = metadata(tmp_path / "rec")
    told = [(each["core:sample_start"], each["core:label"]) for each in meta["annotations"]]
    assert told == [(2000, "burst"), (8000, "gap"), (20_000, "burst"), (20_600, "gap")]
    one, missing, cut, short = meta["annotations"]
    assert one["core:sample_count"] == length
    assert (missing["core:sample_count"], short["core:sample_count"]) == (4000, 50)
    assert missing["core:comment"] == "the radio lost samples: 4000 samples, 2.000 ms"
    assert "0 good, 1 bad" in cut["core:comment"]
    assert cut["core:comment"].endswith(", cut")
    assert [each["core:sample_start"] for each in meta["captures"]] == [0, 12_000, 20_650]
    times = [datetime.fromisoformat(each["core:datetime"]) for each in meta["captures"]]
    # This radio brings its samples at once.
    length_s = timedelta(seconds=34_750 / 2e6)
    assert all(began - length_s <= each <= datetime.now(UTC) for each in times)
    with IqRecording(tmp_path / "rec") as recording:
        assert not recording.read(8000, 4000).any()
        assert recording.read(12_000, 4000).all()


async def test_bursts_of_others_are_told_apart(tmp_path):
    samples, length = air([2000], 8000, network=5)
    await captured(BlockRadio(pieces(samples, 500)), wish(tmp_path / "rec", network=1))
    (burst,) = metadata(tmp_path / "rec")["annotations"]
    assert (burst["core:label"], burst["core:sample_count"]) == ("foreign burst", length)
    assert "PDUs of 64 B: 1, not decoded" in burst["core:comment"]
    assert burst["core:comment"].endswith("network 5")


async def test_a_burst_that_the_end_cuts_ends_with_the_recording(tmp_path):
    samples, _ = air([6500], 9_000)
    radio = BlockRadio(pieces(samples, 500), ends=False)
    report = await captured(radio, wish(tmp_path / "rec", seconds=7200 / RATE_HZ))
    assert (report.n_samples, report.n_bursts, report.pdus_good) == (7200, 1, 0)
    (burst,) = metadata(tmp_path / "rec")["annotations"]
    assert (burst["core:sample_start"], burst["core:sample_count"]) == (6500, 700)
    assert describe(tmp_path / "rec").n_samples == 7200


async def test_while_it_runs_the_recording_reads_and_its_state_is_told(tmp_path):
    samples, _ = air([2000], 20_000)
    radio = BlockRadio(pieces(samples, 500), ends=False)
    states = []

    def watch(state):
        states.append(state)
        if state.recorded_s < len(samples) / RATE_HZ:
            return
        assert metadata(tmp_path / "rec")["annotations"] == []
        assert describe(tmp_path / "rec").n_samples == len(samples)
        capture.stop()

    async with Capture(radio, TUNING, wish(tmp_path / "rec")) as capture:
        report = await capture.run(watch)
    assert report.n_bursts == 1
    assert states[-1].radio == "made by hand"
    assert -40 < states[-1].level_dbfs < -20
    assert not states[0].is_recorded


async def test_who_stops_twice_gets_the_bursts_found_so_far(tmp_path, monkeypatch):
    monkeypatch.setattr(*CONSTANTS["least"], 1 << 40)
    samples, _ = air([2000], 20_000)

    def watch(state):
        if state.recorded_s == len(samples) / RATE_HZ:
            capture.stop()
            capture.stop()

    radio = BlockRadio(pieces(samples, 500), ends=False)
    async with Capture(radio, TUNING, wish(tmp_path / "rec")) as capture:
        report = await capture.run(watch)
    assert (report.seconds, report.searched_s, report.n_bursts) == (0.01, 0, 0)
    assert len(pdus(tmp_path / "rec")) == 1
    metadata(tmp_path / "rec")


async def test_levels_and_values_at_full_scale(tmp_path):
    tone = 0.5 * np.exp(2j * np.pi * 0.05 * np.arange(20_000)).astype(np.complex64)
    report = await captured(BlockRadio(pieces(tone, 500)), wish(tmp_path / "rec"))
    assert report.mean_dbfs == pytest.approx(-6.02, abs=0.01)
    assert report.peak_dbfs == pytest.approx(-6.02, abs=0.01)
    assert report.n_full == 0
    tone[100:110] = 1.5 - 0.2j
    tone[200] = 1j
    tone[300] = complex(np.nan, np.inf)
    report = await captured(BlockRadio(pieces(tone, 500)), wish(tmp_path / "loud"))
    assert report.n_full == 12
    assert report.mean_dbfs == pytest.approx(-6.02, abs=0.1)


async def test_a_full_disk_ends_a_recording_that_stays_valid(tmp_path):
    (tmp_path / "rec.sigmf-data").symlink_to("/dev/full")
    samples, _ = air([2000], 20_000)
    radio = BlockRadio(pieces(samples, 500), ends=False)
    report = await captured(radio, wish(tmp_path / "rec"))
    assert "rec.sigmf-data: cannot be written (No space left on device)" in report.problem
    assert report.n_samples == 0
    assert json.loads((tmp_path / "rec.sigmf-meta").read_text())["annotations"] == []


async def test_a_radio_that_will_not_go_on_leaves_a_whole_recording(tmp_path):
    samples, _ = air([2000], 20_000)
    radio = BlockRadio(pieces(samples, 500), fails="the device was stolen")
    report = await captured(radio, wish(tmp_path / "rec"))
    assert (report.problem, report.n_bursts) == ("the device was stolen", 1)
    assert len(bursts(metadata(tmp_path / "rec"))) == 1


async def test_radios_that_cannot_be_used_are_refused(tmp_path):
    radio = BlockRadio([], receives=False)
    with pytest.raises(UserError, match=r"does not receive \(made by hand\); allowed: one that"):
        await captured(radio, wish(tmp_path / "rec"))
    radio.refuses = "no such device"
    with pytest.raises(UserError, match="no such device"):
        await captured(radio, wish(tmp_path / "rec"))
    with pytest.raises(UserError, match=r"none/rec.sigmf-.* cannot be written \(No such file"):
        await captured(BlockRadio([]), wish(tmp_path / "none" / "rec"))
    assert not list(tmp_path.iterdir())


async def test_a_fault_of_ours_is_raised_and_nothing_hangs(tmp_path, monkeypatch):
    def fail(self, *_):
        raise ZeroDivisionError

    monkeypatch.setattr(BurstFinder, "look", fail)
    samples, _ = air([2000], 60_000)
    with pytest.raises(ZeroDivisionError):
        await captured(BlockRadio(pieces(samples, 100), ends=False), wish(tmp_path / "rec"))
