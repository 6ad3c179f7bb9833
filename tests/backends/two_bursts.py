"""Two bursts, and whether they were heard."""

import numpy as np
import pytest

from backends import (
    TxBurst,
    TxOutcome,
)
from phy import REACH, Transmitter


def two_bursts(first):
    """Bursts of a modem; the second one has a `latest` that it will meet."""
    rng = np.random.default_rng(6)
    samples = [0.2 * Transmitter().modulate([rng.bytes(60)], 1) for _ in range(2)]
    second = first + len(samples[0]) + 500
    return [TxBurst(first, samples[0]), TxBurst(second, samples[1], second)]


def assert_heard(stream, sent, reports, gain_db=0.0):
    """Assert that each burst is where its report says, with only the filter's error."""
    for burst, report in zip(sent, reports, strict=True):
        assert report.outcome is TxOutcome.SENT
        assert (report.start, report.end) == (burst.start, burst.start + len(burst.samples))
        got = stream[report.start + REACH : report.end - REACH]
        expected = burst.samples[REACH:-REACH]
        gain = np.vdot(expected, got) / np.vdot(expected, expected)
        assert 20 * np.log10(abs(gain)) == pytest.approx(gain_db, abs=0.05)
        error = np.mean(np.abs(got - gain * expected) ** 2)
        assert error < 1e-3 * np.mean(np.abs(gain * expected) ** 2)
