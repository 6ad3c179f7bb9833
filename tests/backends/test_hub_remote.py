"""A hub on another computer: its address, and its clock in terms of ours."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backends import BackendError, EtherParams, ModemNeeds, find_backend, hub_at
from backends.testing import WINDOW_S, HubClock
from tests.laws import law

MS = 1_000_000
NEEDS = ModemNeeds(1e6, 1, 433e6, 1e-3)


def test_an_address_is_two_endpoints():
    hub = hub_at("10.0.0.7:47900", "ether.hub")
    assert (hub.air, hub.sky) == ("tcp://10.0.0.7:47900", "tcp://10.0.0.7:47901")
    assert (hub.name, hub.is_remote) == ("10.0.0.7:47900", True)


@pytest.mark.parametrize("text", ["", "host", ":47900", "host:", "host:x", "host:0", "host:65535"])
def test_what_is_no_address_is_refused(text):
    with pytest.raises(BackendError, match=r"ether\.hub: got .*HOST:PORT.*192\.168\.1\.5:47900"):
        hub_at(text, "ether.hub")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({}, 'ether.dir: got ""'),
        ({"dir": "air", "hub": "a:1"}, 'ether.hub: got "a:1" beside ether.dir; allowed: one of'),
        ({"hub": "a"}, 'ether.hub: got "a"; allowed: HOST:PORT'),
    ],
)
def test_settings_that_do_not_name_one_hub_are_refused(given, words):
    assert words in find_backend("ether").problem(EtherParams(**given), NEEDS)


@pytest.mark.parametrize("given", [{"dir": "air"}, {"hub": "a:1"}])
def test_settings_that_name_one_hub_are_good(given):
    backend, ether = find_backend("ether"), EtherParams(**given)
    assert backend.problem(ether, NEEDS) == ""
    assert (ether.hub or ether.dir) in backend.unchecked(ether)[0]


@pytest.mark.slow
@law()
@given(
    offset_s=st.floats(-1e6, 1e6),
    drift_ppm=st.floats(-100, 100),
    delays_ms=st.lists(st.floats(0, 50), min_size=200, max_size=600),
)
def test_a_time_is_late_by_the_shortest_travel_of_the_last_seconds(offset_s, drift_ppm, delays_ms):
    clock, period_s, arrived_ns, travelled_ns = HubClock(is_remote=True), 0.02, 0, []
    # Two crystals move apart by so much while an offset is in use.
    slack_ns = 1e3 * abs(drift_ppm) * 2.1 * WINDOW_S + 2e3
    for k, delay_ms in enumerate(delays_ms):
        true_ns = round(1e9 * k * period_s)
        hub_ns = round(true_ns * (1 + 1e-6 * drift_ppm) + 1e9 * offset_s)
        arrived_ns = max(arrived_ns, true_ns + round(MS * delay_ms))
        travelled_ns.append(arrived_ns - true_ns)
        clock.observe(hub_ns, arrived_ns)
        late_ns = clock.local_ns(hub_ns) - true_ns
        shortest_ns = min(travelled_ns[-round(0.9 * WINDOW_S / period_s) :])
        assert -slack_ns <= late_ns <= shortest_ns + slack_ns
