"""What the analysis finds in a recording."""

import numpy as np
import pytest

import phy
from sdrlinkd.errors import UserError
from sdrlinkd.iq import IqRecording, modem_info, spectrum_of
from tests.iq.recordings import RATE_HZ, write_bursts


def silent(_):
    """Report no progress."""


@pytest.mark.parametrize("sample_type", ["cf32_le", "ci16_le", "ci8"])
def test_every_pdu_in_a_recording_is_found(tmp_path, sample_type):
    sent = write_bursts(tmp_path / "rec", sample_type=sample_type)
    seen = []
    with IqRecording(tmp_path / "rec") as recording:
        events = [event for event, _ in recording.decode(None, seen.append)]
    assert [event.data for event in events if isinstance(event, phy.PduHeard)] == sent
    over = [event for event in events if isinstance(event, phy.BurstOver)]
    assert [(each.burst.mcs, each.n_good, each.ending) for each in over] == [
        (1, 2, "whole"), (3, 2, "whole"), (6, 2, "whole"),
    ]  # fmt: skip
    assert {each.burst.network for each in over} == {2}
    assert all(abs(each.burst.cfo * RATE_HZ - 8e-6 * 2.45e9) < 500 for each in over)
    assert seen[-1] == recording.info.n_samples


def test_another_network_is_skipped(tmp_path):
    write_bursts(tmp_path / "rec")
    with IqRecording(tmp_path / "rec") as recording:
        events = [event for event, _ in recording.decode(1, silent)]
    assert [event.ending for event in events] == ["foreign"] * 3


def test_points_lie_where_they_were_meant(tmp_path):
    write_bursts(tmp_path / "rec", snr_db=30)
    with IqRecording(tmp_path / "rec") as recording:
        points = recording.points(None, silent)
    assert [each.name for each in points.by_modulation] == ["QPSK", "QAM16", "QAM64"]
    assert len(points.bursts) == 3
    for modulation, got in points.by_modulation.items():
        meant = phy.points(modulation)
        nearest = meant[np.abs(got[:, None] - meant).argmin(axis=1)]
        assert np.mean(np.abs(got - nearest) ** 2) < 0.003


def test_the_spectrum_shows_a_tone_where_and_as_strong_as_it_is(tmp_path):
    n = 100_000
    tone = 0.1 * np.exp(2j * np.pi * 0.125 * np.arange(n))
    tone.astype(np.complex64).tofile(tmp_path / "tone.cf32")
    with IqRecording(tmp_path / "tone.cf32") as recording:
        spectrum = spectrum_of(recording, silent)
    peak = int(spectrum.mean.argmax())
    assert spectrum.frequency[peak] == 0.125
    assert spectrum.mean[peak] == pytest.approx(-20, abs=0.1)
    assert np.median(spectrum.mean) < -100
    assert spectrum.waterfall.shape == (len(spectrum.time), len(spectrum.frequency))


def test_the_spectrum_of_a_handful_of_samples_is_drawn_too(tmp_path):
    np.ones(3, np.complex64).tofile(tmp_path / "short.cf32")
    with IqRecording(tmp_path / "short.cf32") as recording:
        spectrum = spectrum_of(recording, silent)
    assert np.isfinite(spectrum.mean).all()


def test_an_empty_recording_is_refused(tmp_path):
    (tmp_path / "none.cf32").write_bytes(b"")
    with pytest.raises(UserError, match="contains no samples"):
        IqRecording(tmp_path / "none.cf32")


def test_the_modems_table_follows_from_the_grid():
    told = modem_info(rate_hz=5e6, pdu_size=1024, max_burst_s=0.005)
    assert (told.n_fft, told.n_cp, told.n_data, told.n_pilots) == (64, 16, 48, 4)
    assert told.symbol_us == 16
    assert told.preamble_us == pytest.approx((352 + 160) / 5)
    assert [row.rate_bit_s / 1e6 for row in told.mcs] == [1.5, 3, 4.5, 6, 9, 12, 13.5, 15, 18, 20]
    qpsk = told.mcs[1]
    n_symbols = -(-2 * 8 * 1028 // 96)
    assert qpsk.one_pdu_ms == pytest.approx((512 + 80 * n_symbols) / 5e3)
    for row in told.mcs:
        assert row.burst_pdus == 1 or row.burst_ms <= 5
        assert row.burst_goodput_bit_s < row.rate_bit_s
    with pytest.raises(UserError, match="bytes of a PDU: got 5000; allowed: 1 to 2047"):
        modem_info(5e6, 5000, 0.005)
