"""Worst cases of the flows of a team."""

import msgspec
import pytest

from sdrlinkd.plan import team_worst_s
from sdrlinkd.reports import ReservedFlowReport
from tests.plan.team import setting

FLOW = ReservedFlowReport(
    src=1, topic_id=0, name="scan", qos="latency", priority=64, dst=2, via=[], rate_hz=50.0,
    size=990, air_pct=7.4, admitted=True,
)  # fmt: skip


def changed(**fields):
    return msgspec.structs.replace(FLOW, **fields)


def test_each_hop_adds_as_much():
    (one,) = team_worst_s([FLOW], setting()).values()
    (two,) = team_worst_s([changed(via=[3])], setting()).values()
    assert 0 < one < 0.1
    assert two == pytest.approx(2 * one)


def test_flows_of_the_same_robot_wait_for_each_other_and_refused_ones_do_not_count():
    bulk = changed(topic_id=17, qos="bulk", size=65536, rate_hz=5.0)
    alone = team_worst_s([FLOW], setting())
    beside = team_worst_s([bulk, FLOW], setting())
    assert beside[1, 0] > alone[1, 0]
    assert beside[1, 17] > beside[1, 0]
    refused = team_worst_s([changed(topic_id=17, admitted=False), FLOW], setting())
    assert refused == alone
