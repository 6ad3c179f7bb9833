"""The MCS of a burst follows neighbors' reports, neither too fast nor oscillating."""

from math import log10
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.link import Qos, RateParams
from sdrlinkd.link.transmit import (
    HIGH_PER,
    KEPT_CHANGES,
    LOW_PER,
    MAX_PENALTY_DB,
    PENALTY_DECAY_DB,
    PENALTY_STEP_DB,
    RateControl,
)
from sdrlinkd.wire import BROADCAST, LinkReport
from tests.laws import law

NEEDED = (1.0, 4.0, 7.0, 10.0, 13.0, 17.0, 19.0)
MARGIN, URGENT_MARGIN, HYSTERESIS = 2.0, 5.0, 1.5
ALL = {BROADCAST}
ME = 1


def make(fixed=1, **params):
    return RateControl(RateParams(**{"adapt": True, **params}), NEEDED, fixed)


def tell(rate, src, snr_db, at=0.0, per=0.0, is_heard=True):
    """`src` reports how well it hears us."""
    if is_heard:
        rate.heard(src, at)
    rate.take(src, LinkReport(ME, round(4 * snr_db), round(255 * per), 0), at)


def choice(rate, to=ALL, qos=Qos.DEFAULT, at=0.0):
    return rate.mcs(to, qos, at)


@pytest.mark.parametrize("mcs", range(1, 7))
@pytest.mark.parametrize(("qos", "margin"), [(q, URGENT_MARGIN) for q in (Qos.URGENT, Qos.LATENCY)]
                         + [(q, MARGIN) for q in (Qos.DEFAULT, Qos.BULK)])  # fmt: skip
def test_an_mcs_is_taken_with_its_margin_and_the_hysteresis_in_hand(mcs, qos, margin):
    enough = NEEDED[mcs] + margin + HYSTERESIS
    for snr_db, best in ((enough - 0.25, mcs - 1), (enough, mcs)):
        rate = make(hysteresis_db=HYSTERESIS)
        tell(rate, 2, snr_db)
        # From below, and not past the next one, which needs at least 2 dB more.
        assert choice(rate, qos=qos) == best


@pytest.mark.parametrize("mcs", range(1, 7))
def test_it_is_left_downwards_as_soon_as_the_margin_is_gone(mcs):
    rate = make()
    tell(rate, 2, NEEDED[mcs] + MARGIN + HYSTERESIS)
    assert choice(rate) == mcs
    tell(rate, 2, NEEDED[mcs] + MARGIN)
    assert choice(rate) == mcs
    tell(rate, 2, NEEDED[mcs] + MARGIN - 0.25)
    assert choice(rate) == mcs - 1


@law(60)
@given(st.integers(0, 2**32), st.floats(0, 25))
def test_snr_that_jitters_within_the_hysteresis_changes_nothing(seed, snr_db):
    rng = Random(seed)
    rate = make(hysteresis_db=HYSTERESIS)
    told = [snr_db + rng.uniform(0, HYSTERESIS - 0.5) for _ in range(200)]
    chosen = []
    for second, each in enumerate(told):
        tell(rate, 2, each, at=second)
        chosen.append(choice(rate, at=second))
    steps = sum(a != b for a, b in zip([0, *chosen], chosen, strict=False))
    # Up once; and down, if the first one was among the best.
    assert steps <= 2, f"seed {seed}"


def test_without_hysteresis_it_would_flap():
    """The control."""
    rate = make(hysteresis_db=0.0)
    rng = Random(1)
    for second in range(200):
        tell(rate, 2, NEEDED[3] + MARGIN + rng.uniform(-0.5, 0.5), at=second)
        choice(rate, at=second)
    assert len(rate.changes) > 50


def test_the_margin_is_kept_by_class_and_each_class_has_its_own_hysteresis():
    rate = make()
    tell(rate, 2, 15.0)
    assert (choice(rate, qos=Qos.BULK), choice(rate, qos=Qos.URGENT)) == (3, 2)
    assert choice(rate) == 3
    assert [(change.node, change.mcs) for change in rate.changes] == [(2, 3)]


def test_loss_is_answered_by_caution_that_wears_off():
    rate = make()
    snr_db = NEEDED[3] + MARGIN + HYSTERESIS
    tell(rate, 2, snr_db)
    assert choice(rate) == 3
    for step in range(1, 30):
        tell(rate, 2, snr_db, per=2 * HIGH_PER)
        usable = snr_db - MARGIN - min(step * PENALTY_STEP_DB, MAX_PENALTY_DB)
        assert choice(rate) == max(mcs for mcs in range(7) if NEEDED[mcs] <= usable or mcs == 0)
    worst = choice(rate)
    assert worst < 3
    for _ in range(100):
        tell(rate, 2, snr_db, per=(LOW_PER + HIGH_PER) / 2)
    assert choice(rate) == worst, "some loss: no more caution and no less"
    back = 0
    while choice(rate) < 3 and back < 1000:
        tell(rate, 2, snr_db, per=0.0)
        back += 1
    assert back == round(MAX_PENALTY_DB / PENALTY_DECAY_DB), "no slower, and nothing saved up"


def test_without_a_report_for_long_it_is_the_lowest():
    rate = make(min_mcs=1, stale_s=3.0)
    tell(rate, 2, 25.0, at=10.0)
    assert choice(rate, at=10.0) == 6
    rate.heard(2, 12.9)
    assert choice(rate, at=12.9) == 6
    rate.heard(2, 13.1)
    assert choice(rate, at=13.1) == 1
    tell(rate, 2, 25.0, at=14.0)
    assert choice(rate, at=14.0) == 6


def test_a_robot_that_is_gone_holds_nobody_back():
    rate = make(forget_s=60.0)
    tell(rate, 2, 3.0, at=0.0)
    for at in (0.0, 59.0, 61.0):
        tell(rate, 3, 25.0, at=at)
        assert choice(rate, at=at) == (0 if at < 60 else 6)


def test_a_neighbor_that_says_nothing_of_us_may_not_hear_us():
    rate = make(min_mcs=1)
    tell(rate, 2, 25.0)
    rate.heard(3, 0.0)
    assert choice(rate) == 1
    assert choice(rate, to={3}) == 1
    assert choice(rate, to={2}) == 6
    assert rate.heard_there(3) == (None, None, 1)


def test_nobody_there_gets_the_lowest():
    rate = make(min_mcs=2)
    assert choice(rate) == rate.lowest == 2
    assert choice(rate, to={7}) == 2
    tell(rate, 2, 25.0)
    assert choice(rate, to={7}) == 2


@law(60)
@given(st.dictionaries(st.integers(2, 20), st.floats(0, 30), min_size=1, max_size=6))
def test_a_broadcast_suits_the_worst_and_a_unicast_its_own(snrs):
    rate = make()
    for src, snr_db in snrs.items():
        tell(rate, src, snr_db)
    alone = {src: choice(rate, to={src}) for src in snrs}
    assert choice(rate) == min(alone.values())
    assert choice(rate, to={BROADCAST, min(snrs)}) == min(alone.values())
    for src, other in zip(snrs, reversed(snrs), strict=True):
        assert choice(rate, to={src, other}) == min(alone[src], alone[other])
        assert rate.heard_there(src).mcs == alone[src]


@law(60)
@given(st.lists(st.floats(-40, 40), min_size=2, max_size=2), st.sampled_from(list(Qos)))
def test_more_snr_is_never_a_slower_mcs(snrs, qos):
    low, high = (make(), make())
    tell(low, 2, min(snrs))
    tell(high, 2, max(snrs))
    assert choice(low, qos=qos) <= choice(high, qos=qos)
    assert low.suggested(min(snrs)) <= high.suggested(max(snrs))


@pytest.mark.parametrize(("low", "high"), [(0, 9), (2, 4), (3, 3), (5, 9)])
def test_it_stays_between_the_bounds(low, high):
    rate = make(min_mcs=low, max_mcs=high)
    assert rate.usable == range(low, min(high, 6) + 1)
    for snr_db in range(-30, 31):
        tell(rate, 2, snr_db)
        assert choice(rate) in rate.usable
        assert rate.suggested(snr_db) in rate.usable


def test_a_fixed_mcs_stays_whatever_is_said():
    rate = make(fixed=4, adapt=False)
    assert (rate.lowest, rate.usable) == (4, range(4, 5))
    for snr_db in (-20, 30):
        tell(rate, 2, snr_db, per=1.0)
        assert {choice(rate, qos=qos) for qos in Qos} == {4}
    assert rate.heard_there(2).mcs == 4
    assert not rate.changes
    assert make(fixed=12, adapt=False).lowest == 6


def test_it_suggests_what_it_would_like_to_hear():
    rate = make()
    assert [rate.suggested(snr_db) for snr_db in (-9, 5.9, 6.0, 12.0, 40)] == [0, 0, 1, 3, 6]


def test_what_was_told_can_be_asked_for():
    rate = make()
    tell(rate, 2, 7.25, per=0.2)
    assert rate.heard_there(2)[:2] == (7.25, pytest.approx(0.2, abs=1 / 255))
    assert rate.heard_there(9) == (None, None, rate.lowest)


def test_a_report_alone_makes_a_neighbor():
    rate = make()
    tell(rate, 2, 25.0, is_heard=False)
    assert choice(rate) == 6


def test_only_the_last_changes_are_kept():
    rate = make()
    for i in range(2 * KEPT_CHANGES):
        tell(rate, 2, 25.0 if i % 2 else 0.0, at=float(i))
        choice(rate, at=float(i))
    assert len(rate.changes) == KEPT_CHANGES
    last = rate.changes[-1]
    assert (last.at, last.node, last.mcs) == (2 * KEPT_CHANGES - 1, 2, 6)


def hear(rate, src, snrs_db, at=0.0):
    """Bursts of `src` come, with these SNRs, 0.01 s apart; returns when the last one did."""
    for snr_db in snrs_db:
        at += 0.01
        rate.heard(src, at, snr_db)
    return at


def faded(mean_db, n, seed=1):
    """The SNR of bursts on a Rayleigh channel."""
    rng = Random(seed)
    return [mean_db + 10 * log10(rng.expovariate(1.0)) for _ in range(n)]


@pytest.mark.parametrize("spread_db", [0.0, 0.8])
def test_where_the_snr_is_steady_there_is_no_further_margin(spread_db):
    steady, rate, rng = make(), make(), Random(1)
    hear(rate, 2, [20 + rng.uniform(-spread_db, spread_db) for _ in range(300)])
    for each in (steady, rate):
        tell(each, 2, 20.0, at=4.0)
    assert [choice(rate, qos=q, at=4.0) for q in Qos] == [
        choice(steady, qos=q, at=4.0) for q in Qos
    ]


def test_where_it_fades_few_bursts_are_lost_and_of_urgent_ones_the_fewest():
    rate, mean_db = make(), 24.0
    at = hear(rate, 2, faded(mean_db, 300))
    tell(rate, 2, mean_db - 2.5, at=at)
    later = faded(mean_db, 20_000, 2)
    lost = {
        qos: sum(snr_db < NEEDED[choice(rate, qos=qos, at=at)] for snr_db in later) / len(later)
        for qos in Qos
    }
    assert choice(rate, qos=Qos.URGENT, at=at) == 0
    assert lost[Qos.URGENT] < 0.01
    assert lost[Qos.LATENCY] < 0.03
    assert lost[Qos.BULK] < 0.15
    steady = make()
    tell(steady, 2, mean_db - 2.5)
    assert choice(rate, at=at) < choice(steady)


def test_pdus_of_one_burst_say_no_more_than_one():
    one, many = make(), make()
    for i, snr_db in enumerate(faded(24.0, 200)):
        for rate, n in ((one, 1), (many, 9)):
            for _ in range(n):
                rate.heard(2, 0.01 * i, snr_db)
    for rate in (one, many):
        tell(rate, 2, 21.0, at=3.0)
    assert choice(one, at=3.0) == choice(many, at=3.0)


def test_a_hundred_steady_bursts_take_the_margin_back_and_one_step_adds_none():
    fresh, rate, stepped = make(), make(), make()
    at = hear(rate, 2, faded(24.0, 200))
    at = hear(rate, 2, [20.0] * 100, at)
    hear(stepped, 2, [40.0] * 50 + [20.0])
    for each in (fresh, rate, stepped):
        tell(each, 2, 20.0, at=at)
    for qos in (Qos.URGENT, Qos.DEFAULT):
        assert choice(rate, qos=qos, at=at) == choice(stepped, qos=qos, at=at)
        assert choice(rate, qos=qos, at=at) == choice(fresh, qos=qos, at=at)
