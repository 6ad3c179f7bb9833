"""A short session through real processes; the machine's speed is not tested."""

import numpy as np
import pytest

from benchmarks.absent import PeerError
from benchmarks.daemons import running
from benchmarks.latency.session import run
from benchmarks.peers.latency.table import BAUD, PEERS, unavailable

FRAME = 134
"""Minimum size of a frame in bytes."""


@pytest.mark.long
def test_xrce_from_end_to_end():
    session = run("xrce", seconds=0.5, warmup_s=0.2)
    for way in (session.forward, session.backward):
        assert way.n_sent == 100
        assert 0 < way.n_heard == len(way.true_s) <= way.n_sent
        assert way.true_s.min() >= FRAME * 10 / BAUD
        assert len(way.stamps.exchanges)
        assert np.isnan(way.corrected_s).all()  # too short for the filter
    assert set(session.cpu_share) == set(session.rss_mib) == {"companion", "fcu", "line", "agent"}
    assert min(session.rss_mib.values()) > 1
    assert session.line_late_s.min() >= 0


def test_peers_that_are_not_there():
    assert "carrier pigeon" in unavailable("carrier pigeon")
    with pytest.raises(PeerError, match=", ".join(PEERS)):
        run("carrier pigeon", seconds=1.0)


@pytest.mark.slow
def test_a_daemon_that_does_not_start_says_why():
    daemons = running("direct", [1], ["a"], "[link]\nnonsense = 1\n", "")
    with pytest.raises(PeerError, match=r"daemon_1: .*link\.nonsense: unknown key"), daemons:
        pass


@pytest.mark.parametrize("given", [{"n_topics": 0}, {"n_topics": 16}, {"size": 12}])
def test_what_cannot_be_asked_for(given):
    with pytest.raises(ValueError, match="possible"):
        run("xrce", seconds=1.0, **given)
