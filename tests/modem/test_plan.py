"""When bursts may leave: never more is committed than the lead and one burst."""

from hypothesis import given
from hypothesis import strategies as st

from backends import GAP, TxWindows
from sdrlinkd.modem.testing import AirPlan, LoadMeter, TxWindowPlan


def test_an_idle_air_takes_a_burst_after_the_lead():
    plan = AirPlan(lead=100)
    assert plan.wait(now=5000) == 0
    assert plan.start(now=5000) == 5100


def test_a_busy_air_is_waited_for_until_the_lead_before_its_end():
    plan = AirPlan(lead=100)
    plan.commit(1000, 4000)
    free = 5000 + GAP
    assert plan.wait(now=1000) == free - 1100
    assert plan.wait(now=free - 100) == 0
    assert plan.start(now=free - 100) == free


def test_the_next_burst_is_composed_ahead_without_a_pause_on_the_air():
    plan = AirPlan(lead=100, ahead=50)
    plan.commit(1000, 4000)
    free = 5000 + GAP
    assert plan.wait(now=free - 150) == 0
    assert plan.start(now=free - 150) == plan.start(now=free - 100) == free


@given(st.integers(0, 500), st.integers(0, 500), st.integers(1, 100))
def test_a_lead_that_grew_by_late_bursts_comes_back(lead, ahead, n_late):
    plan = AirPlan(lead, ahead)
    for _ in range(n_late):
        plan.was_late()
    assert lead <= plan.start(now=0) <= lead + ahead
    for _ in range(500):
        plan.was_in_time()
    assert plan.start(now=0) == lead


@given(st.integers(0, 500), st.lists(st.tuples(st.integers(1, 3000), st.integers(0, 3000))))
def test_bursts_follow_each_other_and_never_more_than_one_is_ahead(lead, bursts):
    plan, now, end = AirPlan(lead), 0, 0
    for n_samples, idle in bursts:
        now += idle
        now += plan.wait(now)
        start = plan.start(now)
        assert start >= end
        assert start - now <= lead
        plan.commit(start, n_samples)
        end = start + n_samples


def test_the_load_is_a_mean_over_about_a_second():
    load = LoadMeter()
    assert load.realtime_ratio == 0
    for _ in range(5000):
        load.add(cpu_s=0.00025, stream_s=0.001)
    assert abs(load.realtime_ratio - 4) < 0.1


TX_WINDOWS = TxWindows(follow_s=0.03, pause_s=0.2, longest_s=0.5)


def test_a_burst_joins_the_window_that_is_open_or_waits_for_the_next():
    plan = TxWindowPlan(lead=100, ahead=10, tx_windows=TX_WINDOWS, rate_hz=1000.0)
    assert plan.start(now=0) == 100
    plan.commit(100, 50)
    free = 150 + GAP
    # In time for the same TX window: right after the burst before.
    assert plan.wait(now=60) == 12
    assert plan.start(now=free - 30) == free
    # Too late for it: a pause, in which the radio listens.
    assert plan.start(now=free - 29) == free + 200
    assert plan.wait(now=free - 29) == 200 + 29 - 100


def test_a_tx_window_is_not_longer_than_it_may_be():
    plan = TxWindowPlan(lead=100, ahead=10, tx_windows=TX_WINDOWS, rate_hz=1000.0)
    now, begun = 0, plan.start(0)
    start = begun
    while start - begun < 500:
        plan.commit(start, 50)
        now = start + 10
        end, start = start + 50 + GAP, plan.start(now)
    assert start >= end + 200
