"""The verdict on a run that did not deliver everything, and whether that is a fault."""

import pytest
from msgspec.structs import replace

from sdrlinkd.demo import RunResult, is_good, verdict
from sdrlinkd.demo.testing import PhyResult

HEARD = PhyResult(
    mcs="QPSK 1/2", mcs_index=1, rate_hz=5e6, channel="awgn", snr_db=15.0, clock_ppm=10.0,
    bursts=9, pdus_good=9, pdus_bad=0, headers_bad=0, samples_lost=0, snr_db_measured=15.0,
    realtime_ratio=9.0, busy=0.3, waited=0.05,
)  # fmt: skip
GOOD = RunResult(
    name="ofdm", source="built-in robot", seed=1, pdu_size=64, duration_s=15.0, sent=1500,
    received=1500, pdr=1.0, goodput_bytes_per_s=5e4, latency_ms={}, path_error_m=0.0,
    bytes_identical=True, entries_per_message=20.0, pdus_sent=9, ledger_adds_up=True, dropped={},
    topics=[], left_out=[], damage="", phy=HEARD,
)  # fmt: skip
SHORT = replace(GOOD, received=1496, pdr=0.997)


def with_phy(result, **changes):
    return replace(result, phy=replace(HEARD, **changes))


def test_of_a_run_that_brought_everything_nothing_is_told():
    assert (is_good(GOOD), verdict(GOOD)) == (True, "")


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"busy": 1.0, "waited": 0.02}, "the CPU is too slow for 5 Msps"),
        ({"busy": 0.8, "waited": 0.4}, "other programs used the CPU for 6.0 s"),
        ({"busy": 0.3, "waited": 0.01}, "the daemon stalled"),
    ],
)
def test_samples_that_were_lost_have_a_cause_of_their_own(changes, says):
    slow = with_phy(SHORT, samples_lost=10_783_020, **changes)
    assert not is_good(slow)
    assert "ofdm: 4 of 1500 messages did not arrive: the receiver lost 2.2 s of the 15.0 s" in (
        verdict(slow)
    )
    assert says in verdict(slow)


def test_who_falls_behind_loses_messages_before_samples():
    slow = with_phy(replace(SHORT, dropped={"tx_stalled": 4}), busy=0.99, waited=0.03)
    assert "the receiver fell behind: the CPU is too slow" in verdict(slow)


def test_what_the_noise_takes_is_no_fault():
    noisy = with_phy(SHORT, mcs="64QAM 3/4", mcs_index=6)
    assert is_good(noisy)
    assert "64QAM 3/4 loses nothing from 18 dB upward, but this channel has 15 dB" in verdict(noisy)
    fading = with_phy(SHORT, channel="rayleigh")
    assert is_good(fading)
    assert "with fading (rayleigh)" in verdict(fading)


def test_a_clean_link_has_to_bring_everything():
    assert not is_good(SHORT)
    dropped = replace(SHORT, phy=None, dropped={"tx_expired": 4})
    assert not is_good(dropped)
    assert verdict(dropped).endswith("4 of 1500 messages did not arrive: 4 tx_expired")


def test_changed_bytes_and_a_ledger_that_is_off_are_faults_on_any_air():
    noisy = with_phy(SHORT, snr_db=3.0, mcs_index=6)
    assert is_good(noisy)
    assert not is_good(replace(noisy, bytes_identical=False))
    assert not is_good(replace(noisy, ledger_adds_up=False))
    assert "differ from those sent" in verdict(replace(GOOD, bytes_identical=False))
    assert "does not add up" in verdict(replace(GOOD, ledger_adds_up=False))
    # Where nothing arrived, nothing was changed.
    assert is_good(replace(noisy, received=0, bytes_identical=False))
