"""Figures of `benchmarks.team`, which are exact on every machine."""

import pytest

from benchmarks.team.chain import carry
from benchmarks.team.driving import drive
from benchmarks.team.healing import heal
from benchmarks.team.teams import Flow, Team
from benchmarks.team.turnaround import wait_for_turns
from tests.laws import trials


@pytest.mark.long
@pytest.mark.parametrize("to_all", [False, True])
def test_a_route_heals_in_time_and_nothing_is_lost(to_all):
    for seed in range(101, 101 + trials(3)):
        found = heal(seed, to_all=to_all)
        assert found.back_s < 0.4
        assert found.lost == 0
        assert found.control_share < 0.02


@pytest.mark.slow
def test_the_papers_chain_with_its_joystick_loses_nothing():
    for seed in range(11, 11 + trials(1)):
        found = carry("grant", seed, 8.0)
        assert found.mdr == (1.0, 1.0, 1.0)
        laser_s, _, joystick_s = found.mean_s
        # The first messages come before their period is known.
        assert laser_s < 0.008
        assert joystick_s < 0.008


@pytest.mark.long
def test_a_chain_of_five_carries_half_of_that_and_asks_for_nothing_that_only_waits():
    for seed in range(11, 11 + trials(1)):
        found = carry("grant", seed, 6.0, n=5, load=0.5)
        assert found.mdr == (1.0, 1.0, 1.0)
        assert found.asked < 0.05 * found.pdus


@pytest.mark.long
def test_images_survive_four_hops_that_lose_pdus():
    """At 6.8 dB, each hop loses something of nearly every image."""
    found = carry("grant", 5, 6.0, n=5, load=0.5, snr_db=6.8)
    assert found.asked > found.sent[1]
    laser, image, joystick = found.mdr
    assert laser > 0.98
    assert joystick == 1
    # A relay that is not named yet does not ask: the first image may lack a part.
    assert image >= 0.9


@pytest.mark.long
def test_robots_that_drive_lose_next_to_nothing_while_there_is_a_path():
    """A few are lost where a team falls in two, or comes together: see docs/limits.md."""
    found = drive("grant", 1, 30.0)
    assert found.hops > 1.5
    for qos, least in (("urgent", 0.9999), ("latency", 0.999), ("default", 0.99)):
        assert found.sent[qos] > 100
        assert found.mdr(qos) >= least


@pytest.mark.long
def test_something_urgent_waits_for_a_round_where_radios_turn_round_slowly():
    # A message that is begun at the end of a turn may go on too late for its receivers.
    for size, most, least in ((64, 1.2, 1.0), (2048, 2.3, 0.8)):
        found = wait_for_turns(size, 3, 20.0)
        assert found.p99_s < most * found.longest_round_s
        assert found.mdr >= least
        # Robots that are silent for a round are still heard.
        assert found.forwarded < 100


@pytest.mark.long
@pytest.mark.parametrize("policy", ["tdma", "grant"])
def test_a_relay_asks_for_what_it_lacks(policy):
    """At 6.4 dB, some PDUs in a hundred are lost on each hop."""
    flows = [Flow("scan", 1, 3, 1024, 0.1, 150, 4.0, qos="latency")]
    team = Team((1, 2, 3), ((1, 2), (2, 3)), flows, 1, policy, 288, snr_db=6.4)
    team.simulation.run(21.0)
    (scan,) = team.heard
    assert team.repeats(2).asked >= 3
    assert scan.mdr == 1
