"""Rows with figures that do not depend on the machine's speed, and the shape of the others."""

import numpy as np
import pytest

from benchmarks.latency import rows
from benchmarks.latency.correction import Direction, Stamps
from benchmarks.latency.session import Session, run
from benchmarks.peers.latency import ours, table


@pytest.mark.slow
def test_by_the_air_latencies_and_ages_are_exact():
    told = {row.name: row for row in rows.by_the_air(3, 1.0)}
    assert set(told) == {"ether_115B_200hz_lockstep_std_ms", "age_rms_us_lockstep"}
    assert all(row.ok and row.trials > 350 for row in told.values())


@pytest.mark.slow
def test_records_keep_to_their_share_and_every_receipt_is_a_delivery():
    fast, slow = rows.shares(3, 20.0)
    assert fast.ok, fast
    assert slow.value < 1.2 * rows.SHARE_PCT
    assert slow.peers["period_s"] > 5 * fast.peers["period_s"]
    for row in (fast, slow):
        fates = {name: n for name, n in row.peers.items() if name.startswith("receipts_")}
        assert set(fates) == {"receipts_delivered"}


def test_a_loop_that_knows_how_old_things_are_strays_less():
    row = rows.correction(3, 10)
    assert row.ok, row
    assert row.peers["corrected_mv"] > 0


def made(ms, n=50):
    late_s = np.full(n, 1e-3 * ms)
    return Direction(late_s, late_s, n, n, np.zeros(3), Stamps(np.zeros((0, 4)), np.zeros((0, 4))))


def test_the_papers_table():
    session = Session(made(1.2), made(1.4), {"daemon_1": 0.3}, {"daemon_1": 50.0}, np.zeros(3),
                      np.zeros(0))  # fmt: skip
    told = {row.name: row for row in rows.table({"direct": [session], "xrce": [session]})}
    assert set(told) == {
        f"{peer}_115B_200hz_{what}_ms_{way}"
        for peer in ("direct", "xrce") for what in ("mean", "std") for way in ("fwd", "bwd")
    }  # fmt: skip
    assert told["direct_115B_200hz_mean_ms_fwd"].value == pytest.approx(1.2)
    assert not told["direct_115B_200hz_mean_ms_bwd"].ok
    assert told["xrce_115B_200hz_mean_ms_bwd"].paper == 1.752
    loads = list(rows.load({"direct": [session], "xrce": [session]}))
    assert [row.value for row in loads] == [0.3, 50.0]


@pytest.mark.slow
def test_our_own_daemon_is_measured_like_the_others():
    session = run("direct", seconds=0.5, warmup_s=0.2)
    for way in (session.forward, session.backward):
        assert way.n_sent == 100
        assert 0 < way.n_heard <= 100
        assert way.true_s.min() > 0
    assert set(session.cpu_share) == {"companion", "fcu", "daemon_1"}
    assert {"direct", "ether"} <= set(table.PEERS)
    assert ours.TOPICS["ether"] == 15
