"""Rows with figures that do not depend on the machine's speed, and the shape of the others."""

import numpy as np
import pytest

from benchmarks.latency import rows
from benchmarks.latency.correction import Direction, Stamps
from benchmarks.latency.session import Session, run
from benchmarks.peers.latency import ours, table


@pytest.mark.long
def test_by_the_air_latencies_and_ages_are_exact():
    told = {row.name: row for row in rows.by_the_air(3, 1.0)}
    assert set(told) == {"ether_115B_200hz_lockstep_std_ms", "age_rms_us_lockstep"}
    assert all(row.ok and row.trials > 350 for row in told.values())


@pytest.mark.long
def test_records_keep_to_their_share_and_every_receipt_is_a_delivery():
    fast, slow = rows.shares(3, 20.0)
    assert fast.ok, fast
    assert slow.value < 1.2 * rows.SHARE_PCT
    assert slow.peers["period_s"] > 5 * fast.peers["period_s"]
    for row in (fast, slow):
        fates = {name: n for name, n in row.peers.items() if name.startswith("receipts_")}
        assert set(fates) == {"receipts_delivered"}


def made(ms, corrected_ms=None, n=50):
    late_s = np.full(n, 1e-3 * ms)
    corrected_s = np.full(n, np.nan if corrected_ms is None else 1e-3 * corrected_ms)
    stamps = Stamps(np.zeros((0, 4)), np.zeros((0, 4)))
    errors_s = np.zeros(0 if corrected_ms is None else 3)
    return Direction(corrected_s, late_s, n, n, errors_s, stamps)


def test_the_papers_table():
    used = {"daemon_1": 0.3, "line": 0.1}
    session = Session(made(1.6), made(2.4, 2.1), used, {"daemon_1": 50.0}, np.zeros(3), np.zeros(0))
    found = {name: [session] for name in ("line", "direct", "xrce")}
    told = {row.name: row for row in rows.table(found)}
    assert set(told) == {
        f"{peer}_115B_200hz_{what}_ms_{way}"
        for peer in found for what in ("mean", "std") for way in ("fwd", "bwd")
    }  # fmt: skip
    fwd, bwd = (told[f"line_115B_200hz_mean_ms_{way}"] for way in ("fwd", "bwd"))
    assert (fwd.value, fwd.target, fwd.ok) == (pytest.approx(1.6), 1.678, True)
    assert (bwd.value, bwd.target, bwd.ok) == (pytest.approx(2.4), 2.133, False)
    # True latencies are never shown as corrected ones.
    assert fwd.peers["corrected_pct"] == 0
    assert "corrected_mean" not in fwd.peers
    assert bwd.peers["corrected_pct"] == 100
    assert bwd.peers["corrected_mean"] == pytest.approx(2.1)
    # Only rows on the same line are judged.
    assert [name for name, row in told.items() if row.target is not None] == [
        name for name in told if name.startswith("line_")
    ]
    assert told["xrce_115B_200hz_mean_ms_bwd"].paper == 1.752
    assert told["xrce_115B_200hz_mean_ms_bwd"].peers["on_the_line"] == pytest.approx(
        1.454, abs=1e-3
    )
    assert "on_the_line" not in told["direct_115B_200hz_mean_ms_bwd"].peers
    assert "without a line" in told["direct_115B_200hz_mean_ms_bwd"].includes
    loads = list(rows.load(found))
    assert [row.value for row in loads] == [0.3, 50.0]
    assert loads[0].peers == {"direct": 0.3, "xrce": 0.3}


@pytest.mark.long
def test_our_own_daemon_is_measured_like_the_others():
    session = run("direct", seconds=0.5, warmup_s=0.2)
    for way in (session.forward, session.backward):
        assert way.n_sent == 100
        assert 0 < way.n_heard <= 100
        assert way.true_s.min() > 0
    assert set(session.cpu_share) == {"companion", "fcu", "daemon_1"}
    assert set(rows.OURS) <= set(table.PEERS)
    assert ours.TOPICS["ether"] == 15


@pytest.mark.long
def test_our_daemons_on_the_line_of_the_others():
    session = run("line", seconds=0.5, warmup_s=0.2)
    least_s = table.PEERS["line"].on_the_line_s(115)
    for way in (session.forward, session.backward):
        assert way.n_sent == 100
        assert 0 < way.n_heard <= 100
        assert way.true_s.min() >= least_s
    assert set(session.cpu_share) == {"companion", "fcu", "line", "daemon_1", "daemon_2"}
    assert session.line_late_s.min() >= 0
