"""Bursts end before forecast messages are due, and no class loses its share."""

from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.link import (
    AccessParams,
    ClassesParams,
    ClassParams,
    Opportunity,
    Outcome,
    Overrides,
    PduLinkTraits,
    Qos,
    RateParams,
    TopicPolicy,
)
from sdrlinkd.link.access import Free, Slot
from sdrlinkd.link.schedule import Allowance, Flow, Forecasts, Limits, Shares
from tests.laws import law
from tests.link.world import PDU_S, airtime_s, classes_queued, make_link, most_pdus, next_burst, use

PERIOD_S = 0.02


def learned(jitter_s=0.0, n=20, period_s=PERIOD_S, seed=1, drift=0.0, missing=()):
    rng = Random(seed)
    forecasts = Forecasts()
    for i in range(n):
        if i not in missing:
            at = 1 + i * period_s * (1 + drift) + rng.uniform(-jitter_s, jitter_s)
            forecasts.note("laser", Qos.LATENCY, at)
    return forecasts, 1 + n * period_s * (1 + drift)


@pytest.mark.parametrize("drift", [0.0, 1e-4, -3e-3])
@pytest.mark.parametrize("missing", [(), (9,), (7, 8, 13)])
def test_the_next_message_of_a_periodic_topic_is_foreseen(drift, missing):
    forecasts, due_at = learned(drift=drift, missing=missing)
    found = forecasts.next_due(due_at - PERIOD_S / 2, Qos.BULK)
    assert found.due(due_at - PERIOD_S / 2) == pytest.approx(due_at, abs=1e-6)
    assert not forecasts.is_unforeseen(due_at - PERIOD_S / 2, Qos.BULK, 1.0)


@pytest.mark.parametrize("seed", range(10))
def test_a_source_that_jitters_is_foreseen_within_its_jitter(seed):
    forecasts, due_at = learned(jitter_s=0.001, n=50, seed=seed)
    found = forecasts.next_due(due_at - 0.01, Qos.BULK)
    assert found.due(due_at - 0.01) == pytest.approx(due_at, abs=0.001), f"seed {seed}"
    assert 0.0002 < found.line.jitter_s < 0.001


@law(200)
@given(
    period_s=st.sampled_from([0.003, 0.02, 0.033, 1.0]),
    before=st.integers(5, 40),
    pause=st.one_of(st.floats(1, 10), st.floats(1, 10_000)),
    jitter=st.floats(0, 0.1),
    seed=st.integers(0, 2**32),
)
def test_after_any_pause_the_second_message_is_foreseen_and_all_after_it(
    period_s, before, pause, jitter, seed
):
    rng, forecasts = Random(seed), Forecasts()

    def note(due_at):
        at = due_at + rng.uniform(-jitter, jitter) * period_s
        forecasts.note("laser", Qos.LATENCY, at)

    for i in range(before):
        note(i * period_s)
    again_at = (before - 1 + pause) * period_s
    note(again_at)
    for i in range(1, 30):
        due_at = again_at + i * period_s
        now = due_at - 0.4 * period_s
        found = forecasts.next_due(now, Qos.BULK)
        # A pause of less than half a period is hardly more than jitter.
        off = 0.25 if pause < 1.5 else 3 * jitter + 0.01
        assert abs(found.due(now) - due_at) <= off * period_s + 1e-4
        note(due_at)


@law(60)
@given(
    rate=st.sampled_from([0.1, 1 / 3, 0.5, 0.9, 1.1, 2.0, 3.0, 10.0]),
    jitter=st.floats(0, 0.02),
    seed=st.integers(0, 2**32),
)
def test_another_rate_is_learned_from_eight_messages_or_sixteen(rate, jitter, seed):
    rng, forecasts, period_s = Random(seed), Forecasts(), PERIOD_S / rate
    learned = 16 if 0.75 < rate < 1.25 else 8
    for i in range(-30, 30):
        at = i * (PERIOD_S if i < 0 else period_s)
        shift = rng.uniform(-jitter, jitter) * min(PERIOD_S, period_s)
        forecasts.note("laser", Qos.LATENCY, at + shift)
        now = at + 0.6 * period_s
        if i >= learned and period_s > 0.002:
            found = forecasts.next_due(now, Qos.BULK)
            assert found.due(now) == pytest.approx(at + period_s, abs=0.1 * period_s + 1e-4)


def test_random_times_foretell_nothing_but_are_reckoned_with():
    rng, at = Random(3), 0.0
    forecasts = Forecasts()
    for _ in range(40):
        at += rng.expovariate(50)
        forecasts.note("events", Qos.LATENCY, at)
    assert forecasts.next_due(at, Qos.BULK) is None
    assert forecasts.is_unforeseen(at + 0.001, Qos.BULK, 1.0)
    assert not forecasts.is_unforeseen(at + 2, Qos.BULK, 1.0)
    assert not forecasts.is_unforeseen(at + 0.001, Qos.LATENCY, 1.0)


def test_a_message_that_does_not_come_is_reckoned_with_and_then_forgotten():
    forecasts, due_at = learned()
    assert forecasts.is_unforeseen(due_at + 0.004, Qos.BULK, 1.0)
    later = due_at + 0.011
    assert forecasts.next_due(later, Qos.BULK).due(later) == pytest.approx(due_at + PERIOD_S)
    assert forecasts.next_due(due_at + 4 * PERIOD_S, Qos.BULK) is None


def allow(forecasts, start, longest_s=0.1, has_slots=False, **params):
    classes = ClassesParams(bulk=ClassParams(**params))
    limits = Limits(classes, forecasts)
    return limits.allow(
        start, longest_s, lambda n: airtime_s(0, n), lambda s: int(s / PDU_S + 1e-6), 0.0, 0.0,
        has_slots=has_slots,
    )  # fmt: skip


@pytest.mark.parametrize("before_s", [0.0155, 0.0101, 0.0032, 0.0012])
def test_a_bulk_burst_ends_about_when_something_more_urgent_is_due(before_s):
    forecasts, due_at = learned()
    most = allow(forecasts, due_at - before_s).most
    assert most[Qos.BULK] * PDU_S == pytest.approx(before_s, abs=0.8 * PDU_S)
    assert most[Qos.LATENCY] == most[Qos.URGENT] == 100


def test_when_no_pdu_fits_before_what_is_due_the_air_is_kept_free():
    forecasts, due_at = learned()
    allowance = allow(forecasts, due_at - 0.3 * PDU_S)
    assert allowance.most[Qos.BULK] == 0
    assert due_at < allowance.until < due_at + PDU_S


@pytest.mark.parametrize("before_s", [0.0155, 0.0032, 0.3 * PDU_S, 0.0])
def test_in_slots_of_ones_own_only_the_cap_of_the_class_shortens_a_burst(before_s):
    forecasts, due_at = learned()
    assert allow(forecasts, due_at - before_s, has_slots=True).most == (100,) * 4
    capped = allow(forecasts, due_at - before_s, has_slots=True, max_burst_s=0.003)
    assert capped.most == (100, 100, 100, 3)


def test_nothing_is_waited_for_whose_time_is_over():
    """A link that is asked again at that very time would be asked for ever."""
    forecasts, due_at = learned()
    until = allow(forecasts, due_at - 0.3 * PDU_S).until
    assert allow(forecasts, until).most[Qos.BULK] > 0


def test_the_air_is_kept_free_for_a_tenth_of_the_time_at_most():
    """With fifteen topics, so that something is always due."""
    forecasts = Forecasts()
    for i in range(15):
        for n in range(20):
            forecasts.note(i, Qos.LATENCY, n * 0.02 + i * 0.0013)
    limits = Limits(ClassesParams(), forecasts)
    now, kept_s = 0.4, 0.0
    while now < 0.42:
        allowed = limits.allow(
            now, 1.0, lambda n: airtime_s(0, n), lambda s: int(s / PDU_S), 0.0, 0.0
        )
        step_s = PDU_S * max(allowed.most[Qos.BULK], 0.1)
        if not allowed.most[Qos.BULK]:
            kept_s += step_s
            limits.kept_free(step_s)
        now += step_s
    assert kept_s <= 0.02 + 0.1 * 0.02 + PDU_S


def test_what_nobody_can_foresee_shortens_bursts_and_what_is_alone_has_long_ones():
    forecasts = Forecasts()
    assert allow(forecasts, 1.0, max_burst_s=0.003).most == (100,) * 4
    forecasts.note("stop", Qos.URGENT, 0.9)
    assert allow(forecasts, 1.0, max_burst_s=0.003).most == (100, 100, 100, 3)
    assert allow(forecasts, 2.0, max_burst_s=0.003).most == (100,) * 4


@pytest.mark.slow
@law(40)
@given(st.integers(0, 2**32))
def test_no_class_with_a_share_starves(seed):
    """Each waiting class gets its share of the air, whatever the others want."""
    rng = Random(seed)
    classes = ClassesParams(
        latency=ClassParams(share=rng.choice((0.0, 0.1, 0.3))),
        default=ClassParams(share=rng.choice((0.0, 0.05, 0.2))),
        bulk=ClassParams(share=rng.choice((0.02, 0.1))),
    )
    link = make_link(pdu_size=64, seed=seed, classes=classes)
    now, total_s, used_s = 0.0, 0.0, dict.fromkeys(Qos, 0.0)
    for _ in range(400):
        for qos, n in classes_queued(link).items():
            for _ in range(20 - n):
                link.submit(rng.randrange(3), bytes(rng.randrange(4, 300)), now, Overrides(qos))
        burst = next_burst(link, now)
        link.confirm(burst, Outcome.SENT, now)
        now = burst.start + burst.airtime_s
        total_s += burst.airtime_s
        for qos in burst.classes:
            used_s[qos] += PDU_S
    for qos in Qos:
        share = classes.of(qos).share
        assert used_s[qos] >= share * total_s - 0.02, f"seed {seed}: {qos.label}"
    assert used_s[Qos.URGENT] > 0.3 * total_s
    assert link.audit() == [], f"seed {seed}"


def test_a_class_without_a_share_waits_for_ever():
    """The control of the test above."""
    link = make_link(pdu_size=64, classes=ClassesParams(bulk=ClassParams(share=0.0)))
    link.submit(0, bytes(30), 0.0, Overrides(Qos.BULK))
    for i in range(200):
        link.submit(1, bytes(40), 0.0, Overrides(Qos.URGENT))
        assert set(next_burst(link, i * PDU_S).classes) == {Qos.URGENT}


def test_shares_are_earned_only_while_something_waits():
    shares = Shares(ClassesParams())
    shares.spend(10.0, [Qos.URGENT], [])
    assert shares.owed(0.001) == []
    shares.spend(1.0, [Qos.URGENT], [Qos.BULK])
    assert shares.owed(0.01) == 5 * [Qos.BULK]
    shares.spend(1.0, [Qos.BULK], [Qos.BULK])
    assert shares.owed(0.001) == []


def test_an_urgent_message_never_waits_for_more_than_one_burst():
    link = make_link(pdu_size=64, classes=ClassesParams(bulk=ClassParams(max_burst_s=0.004)))
    for _ in range(300):
        link.submit(0, bytes(1000), 0.0, Overrides(Qos.BULK))
    rng, now, waited = Random(5), 0.0, []
    link.submit(2, bytes(8), 0.0, Overrides(Qos.URGENT))
    for _ in range(400):
        burst = next_burst(link, now)
        if burst is None:
            # The air is kept free for a message that seems to be due.
            now = link.next_wakeup(now)
            continue
        end = burst.start + burst.airtime_s
        if rng.random() < 0.3:
            at = rng.uniform(now, end)
            link.submit(2, bytes(8), at, Overrides(Qos.URGENT))
            waited.append(end - at)
        link.confirm(burst, Outcome.SENT, end)
        now = end
    assert max(waited) <= 0.004 + PDU_S
    assert len(waited) > 50


class Later(Free):
    """Allows a burst half a second after the request."""

    def slot(self, wish):
        return Slot(wish.earliest + 0.5)


@pytest.mark.parametrize(("most_s", "n"), [(0.0, 1), (1.5e-3, 1), (2.9e-3, 2), (1e9, 8)])
def test_a_burst_is_no_longer_than_what_is_made_when_its_slot_begins(most_s, n):
    link = make_link(pdu_size=64)
    use(link, Later())
    for _ in range(40):
        link.submit(0, bytes(50), 0.0)

    def made_by(start):
        return most_s if start == 0.5 else 0.0

    burst = link.next_burst(Opportunity(0.0, airtime_s, most_pdus, made_by=made_by))
    assert (burst.start, len(burst.pdus)) == (0.5, n)


def test_allowance_may_be_cut_for_less_urgent_classes():
    assert Allowance.of(8).least(Qos.LATENCY).most == (8, 8, 1, 1)


def test_made_up_robots_are_forgotten():
    forecasts = Forecasts()
    for i in range(5000):
        for since in (0.0, 5.0, 10.0, 15.0, 20.0):
            forecasts.note(Flow(i, i, 0), Qos.LATENCY, since + 0.001 * i)
    kept = {node for node, _ in forecasts.of_team(25.0, 40.0)}
    assert kept == set(range(5000 - 128, 5000))


def test_a_lifespan_that_can_never_be_met_is_told():
    link = make_link(pdu_size=64)
    traits = PduLinkTraits(lead_s=0.002, pdu_burst_s=(0.0015,))
    link.attach(traits, AccessParams(), RateParams())
    link.set_policies({0: TopicPolicy(lifespan_s=0.003), 1: TopicPolicy(lifespan_s=0.004)})
    (notice,) = link.notices(0.0)
    assert "odom: lifespan_s of 3 ms can never be met" in notice
    assert "takes 3.5 ms" in notice
