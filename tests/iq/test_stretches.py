"""The parts of a recording that are not silence."""

import numpy as np
import pytest

from backends import GAP_LABEL, Annotation, RecordingWriter
from sdrlinkd.errors import UserError
from sdrlinkd.iq import IqRecording, plan_replay
from sdrlinkd.iq.testing import CONSTANTS, PAUSE, WINDOW
from tests.iq.radios import air
from tests.iq.recordings import RATE_HZ

MARGIN = 2 * WINDOW


def planned(tmp_path, samples, silence_dbfs=None, backoff_db=None, type_name="cf32_le"):
    writer = RecordingWriter(tmp_path / "rec", type_name, RATE_HZ, 0)
    writer.write(0, np.asarray(samples, np.complex64))
    writer.close()
    with IqRecording(tmp_path / "rec") as recording:
        return plan_replay(recording, RATE_HZ, silence_dbfs, backoff_db, lambda _: None)


def in_zeros(spans, n=20_000, level=0.25):
    samples = np.zeros(n, np.complex64)
    for first, last in spans:
        samples[first:last] = level
    return samples


@pytest.mark.parametrize("type_name", ["cf32_le", "ci16_le", "ci8"])
@pytest.mark.parametrize("piece", [1 << 18, 32, 96])
def test_bursts_in_noise_are_found_whole(tmp_path, monkeypatch, type_name, piece):
    monkeypatch.setattr(*CONSTANTS["piece"], piece)
    starts = [0, 4000, 5801, 17_000]
    samples, length = air(starts, 20_000)
    found = planned(tmp_path, samples, type_name=type_name).stretches
    assert len(found) == len(starts)
    for start, each in zip(starts, found, strict=True):
        assert max(0, start - MARGIN) <= each.start <= start
        # The last few samples fade to zero.
        assert start + length - 4 <= each.start + each.n <= start + length + MARGIN
        assert 10 * np.log10(each.power) == pytest.approx(-12, abs=0.5)


def test_among_zeros_whatever_is_none_is_found(tmp_path):
    spans = [(1000, 3000), (5000, 5001), (9000, 9000 + 10 * WINDOW)]
    plan = planned(tmp_path, in_zeros(spans, level=1e-4))
    for (first, last), each in zip(spans, plan.stretches, strict=True):
        assert first - MARGIN <= each.start <= first
        assert last <= each.start + each.n <= last + MARGIN
    assert plan.silence_dbfs == -200


def test_short_pauses_are_part_of_a_stretch(tmp_path):
    inside, between = (PAUSE - 1) * WINDOW, (PAUSE + 1) * WINDOW
    spans = [(3200, 6400), (6400 + inside, 9600), (9600 + between, 12_000)]
    (one, other) = planned(tmp_path, in_zeros(spans)).stretches
    assert one.start + one.n <= other.start


def test_the_silence_may_be_named(tmp_path):
    samples = in_zeros([(1000, 3000)]) + in_zeros([(10_000, 12_000)], level=0.01)
    assert len(planned(tmp_path, samples).stretches) == 2
    assert len(planned(tmp_path, samples, silence_dbfs=-30).stretches) == 1
    with pytest.raises(UserError, match=r"nothing in it exceeds -3.0 dBFS; allowed: a lower --si"):
        planned(tmp_path, samples, silence_dbfs=-3)


def test_what_is_longer_than_two_seconds_is_refused(tmp_path):
    long = round(2.1 * RATE_HZ)
    samples = in_zeros([(100_000, 100_000 + long)], n=round(3 * RATE_HZ))
    says = r"stretch at 0.050 s lasts longer than 2 s .* -200.0 dBFS here; change it with --sil"
    with pytest.raises(UserError, match=says):
        planned(tmp_path, samples)
    plan = planned(tmp_path, samples[: 100_000 + round(1.5 * RATE_HZ)])
    assert plan.room_s == pytest.approx(0.5 + 1.5 * plan.stretches[0].n / RATE_HZ)


def test_gaps_are_not_the_silence(tmp_path):
    samples, _ = air([2000, 12_000], 20_000)
    samples[5000:9000] = 0
    writer = RecordingWriter(tmp_path / "rec", "ci16_le", RATE_HZ, 0)
    writer.write(0, samples)
    writer.describe([Annotation(5000, 4000, GAP_LABEL, "")])
    writer.close()
    with IqRecording(tmp_path / "rec") as recording:
        plan = plan_replay(recording, RATE_HZ, None, None, lambda _: None)
    assert len(plan.stretches) == 2
    assert -50 < plan.silence_dbfs < -40


def test_all_alike_is_silence_or_none(tmp_path):
    samples, _ = air([], 20_000)
    with pytest.raises(UserError, match="nothing in it exceeds"):
        planned(tmp_path, samples)
    assert len(planned(tmp_path, samples, silence_dbfs=-80).stretches) == 1


def test_the_backoff_is_that_of_the_strongest(tmp_path):
    samples, _ = air([2000], 20_000)
    assert planned(tmp_path, samples).gain == 1
    assert planned(tmp_path, samples, backoff_db=12).gain == pytest.approx(1, abs=0.05)
    assert planned(tmp_path, samples, backoff_db=20).gain == pytest.approx(0.4, abs=0.02)
    with pytest.raises(
        UserError, match=r"--backoff-db: got 3; .* beyond full scale; .* least (\d)"
    ):
        planned(tmp_path, samples, backoff_db=3)
    loud = in_zeros([(1000, 3000)], level=1.5)
    with pytest.raises(UserError, match=r"as recorded; its peaks would be 3.5 dB beyond full"):
        planned(tmp_path, loud)
    assert planned(tmp_path, loud, backoff_db=6).gain * 1.5 == pytest.approx(0.5, abs=0.02)
