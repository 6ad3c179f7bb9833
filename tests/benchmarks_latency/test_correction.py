"""Latencies by the paper's correction, and by clocks whose error is known."""

import numpy as np
import pytest

from benchmarks.latency.correction import Stamps, direction
from benchmarks.peers.latency.clock import Clock
from benchmarks.peers.latency.job import FIRST_TOPIC, REQUEST, Address, Job
from benchmarks.peers.latency.schedule import REQUESTS_HZ, WARMUP_REQUESTS_HZ, schedule

HERE, THERE = Clock(0.0, 0.0), Clock(3.7, 20.0)
DELAY_S = 0.0016


def job(side, clock, **changes):
    told = {"rate_hz": 200.0, "size": 115, "n_topics": 1, "warmup_s": 6.5, "seconds": 2.0}
    return Job(side, Address("local", "0"), clock, seed=1, **told | changes)


def shown(true, clock):
    return true * clock.rate + clock.offset_s


def stamps(sender, receiver, start, delay_back_s=DELAY_S):
    """Stamps with equal delays everywhere; only the answer may take longer."""
    sends = [(start + at, kind, number) for at, kind, number in schedule(sender)]
    heard = [
        (kind, number, shown(at, sender.clock), shown(at + DELAY_S, receiver.clock))
        for at, kind, number in sends
        if kind != REQUEST
    ]
    asked = np.array([start + at for at, kind, _ in schedule(receiver) if kind == REQUEST])
    answered = shown(asked + DELAY_S, sender.clock)
    t4 = shown(asked + DELAY_S + delay_back_s, receiver.clock)
    exchanges = np.column_stack([shown(asked, receiver.clock), answered, answered, t4])
    return Stamps(np.array(heard), exchanges)


@pytest.mark.parametrize(("here", "there"), [(HERE, THERE), (THERE, HERE)])
def test_the_correction_finds_the_latency_between_two_clocks(here, there):
    sender, receiver = job("companion", here), job("fcu", there)
    found = direction(sender, receiver, stamps(sender, receiver, 5e4))
    assert found.n_sent == found.n_heard == 400
    assert found.true_s == pytest.approx(DELAY_S, abs=1e-9)
    assert found.corrected_s == pytest.approx(DELAY_S, abs=1e-4)
    # The correction: both offset and drift since the machine was started.
    counted = found.stamps.heard[-400:]
    assert np.abs(counted[:, 3] - counted[:, 2]).min() > 3


def test_half_of_an_asymmetry_goes_into_the_correction():
    sender, receiver = job("companion", HERE), job("fcu", HERE)
    found = direction(sender, receiver, stamps(sender, receiver, 5e4, DELAY_S + 0.001))
    assert found.filter_error_s == pytest.approx(0.0005, abs=1e-5)
    assert found.corrected_s == pytest.approx(DELAY_S - 0.0005, abs=1e-5)
    assert found.true_s == pytest.approx(DELAY_S, abs=1e-9)


def test_nothing_is_corrected_before_the_filter_has_converged():
    sender, receiver = job("companion", HERE, warmup_s=1.0), job("fcu", THERE, warmup_s=1.0)
    found = direction(sender, receiver, stamps(sender, receiver, 5e4))
    assert np.isnan(found.corrected_s).all()
    assert len(found.filter_error_s) == 0


def test_no_exchange_at_all():
    sender, receiver = job("companion", HERE), job("fcu", THERE)
    heard = stamps(sender, receiver, 5e4).heard
    found = direction(sender, receiver, Stamps(heard, np.empty((0, 4))))
    assert np.isnan(found.corrected_s).all()
    assert found.true_s == pytest.approx(DELAY_S, abs=1e-9)


def test_the_schedule_has_each_topic_at_its_rate_and_requests_at_theirs():
    of = job("fcu", THERE, n_topics=3)
    sends = schedule(of)
    assert sends == sorted(sends)
    for topic in range(FIRST_TOPIC, FIRST_TOPIC + 3):
        at = np.array([at for at, kind, _ in sends if kind == topic])
        assert len(at) == of.n_warmup + of.n_counted
        assert np.diff(at) == pytest.approx(1 / 200)
    asked = np.array([at for at, kind, _ in sends if kind == REQUEST])
    assert np.sum(asked < 6) == 6 * WARMUP_REQUESTS_HZ
    assert np.sum(asked > 7) == pytest.approx(1.5 * REQUESTS_HZ, abs=1)


def test_a_job_survives_its_line():
    of = job("fcu", THERE)
    assert Job.from_json(of.to_json()) == of
