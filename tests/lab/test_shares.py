"""The capacity that a policy claims against what it carries, in virtual time; and `why`'s text."""

import pytest

from sdrlinkd.link import Told
from tests.lab.saturated import saturated, usrp
from tests.laws import one_in

pytestmark = pytest.mark.slow
FILE = Told("robot.toml", ())
RADIOS = {
    "slow": {},
    "soon": {"block_s": 1e-4},
    "usrp_2msps": {"rate_hz": 2e6, "fit": usrp},
    "usrp_5msps": {"fit": usrp},
    "turns_slowly": {"turnaround_s": 0.01},
}
CLOSE = {"minislot": 0.05, "tdma": 0.08, "csma": 0.5}
"""Tolerances: two thirds of a slot do not end with a PDU, and csma is random."""


@pytest.mark.parametrize("policy", CLOSE)
@pytest.mark.parametrize("radio", one_in(4, RADIOS))
def test_the_share_that_is_told_is_the_share_that_is_carried(policy, radio):
    n = 3
    sim, carried = saturated(policy, n, seed=n, **RADIOS[radio])
    told = sim.stations[1].settled.share
    assert carried == pytest.approx(told, rel=CLOSE[policy])
    assert [line for each in sim.stations.values() for line in each.link.audit()] == []


def why(policy):
    sim, _ = saturated(policy, 2, rate_hz=2e6, fit=usrp, seconds=10.0)
    return sim.stations[1].link.why(0, FILE, sim.now)[-1]


def test_why_tells_an_air_that_idles_between_turns_from_a_full_one():
    idles = why("minislot")
    assert idles.startswith("the channel was idle 9")
    for part in (
        "minislot waits up to 71 ms after every burst on this radio",
        "and leaves 9.1 % of the airtime usable",
        "; tdma would carry 11 times as much (ours ",
    ):
        assert part in idles
    full = why("tdma")
    assert full.startswith("the channel was full (ours 4")
    assert "others' 4" in full
