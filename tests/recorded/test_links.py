"""Losses of real links: logs of messages at a shipyard, signal strengths of an 802.11 grid."""

import json
from itertools import pairwise

import numpy as np

from sdrlinkd.lab import load_scenario
from sdrlinkd.lab.testing import outages_of, read_outages
from tests.lab.scenarios import SHIPPED
from tests.link.images import images_over

SHIPYARD = "log_ax_high_ax_160mhz_6ghz_loc4_robot_control.jsonl"
QUIET = "log_perama_site_ac_80mhz_5ghz_run1_loc2.jsonl"
PERIOD_S = 0.5


def span_s(path):
    """Time from the first message of the log to the end of the last."""
    numbers = [json.loads(line)["payload"]["seqnum"] for line in path.read_text().splitlines()]
    return (max(numbers) - min(numbers) + 1) * PERIOD_S


def test_the_shipyards_outages_are_those_of_its_log(data):
    path = data / "traces" / SHIPYARD
    found = read_outages(path, PERIOD_S, 0.0)
    lost_s = sum(end - begin for begin, end in found)
    assert 0.30 < lost_s / span_s(path) < 0.35
    assert max(end - begin for begin, end in found) > 10
    assert all(0 <= begin < end <= span_s(path) for begin, end in found)
    assert all(one.end_s < other.begin_s for one, other in pairwise(found))
    scenario = load_scenario(SHIPPED / "shipyard-outage.toml")
    world = scenario.world(outages_of(scenario, path.parent))
    tenths = [world.is_out(t / 10) for t in range(round(10 * scenario.duration_s))]
    assert 0 < sum(tenths) < len(tenths)


def test_a_log_without_losses_has_no_outages(data):
    path = data / "traces" / QUIET
    assert span_s(path) > 100
    assert read_outages(path, PERIOD_S, 0.0) == []


def test_over_recorded_links_memory_is_bounded_and_parity_helps(data):
    """PDUs are lost when a real link's signal was weak."""
    rssi = np.load(data / "traces/orbit_links_rssi.npz")["rssi"].astype(float).reshape(-1)[:6000]
    lost = rssi < np.nanquantile(rssi, 0.07)
    got = {share: images_over(lost, share) for share in (0.0, 0.2)}
    assert got[0.2] > got[0.0] + 5
