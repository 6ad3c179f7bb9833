"""The demonstration selects the rate that this machine can sustain, and reports it."""

import signal
import sys
from pathlib import Path

import pytest

from sdrlinkd.demo import Options, find_rate, open_source
from sdrlinkd.demo.testing import LoadOf, Tried, tried_out
from sdrlinkd.process import Process
from tests.waiting import wait_for

OPTIONS = Options(link="direct")


@pytest.mark.parametrize(
    ("busy", "air_at_5", "taken", "n_tried"),
    [
        ([0.30], 0.2, 5e6, 1),
        ([0.66], 0.2, 5e6, 1),
        ([0.70, 0.50], 0.2, 2e6, 2),
        ([0.90, 0.80, 0.66], 0.1, 1e6, 3),
        # No rate leaves a third free: then the one with the most free time is chosen.
        ([0.95, 0.90, 0.85, 0.86], 0.05, 1e6, 4),
        # At 1 Msps the air would be full.
        ([0.90, 0.80], 0.2, 2e6, 2),
        ([0.80], 0.5, 5e6, 1),
    ],
)
def test_a_third_of_the_time_stays_free_and_the_air_is_not_full(busy, air_at_5, taken, n_tried):
    asked = []

    def measure(source, options):
        asked.append((options.link, options.rate_hz))
        at = options.rate_hz
        return Tried(at, busy[len(asked) - 1], air_at_5 * 5e6 / at)

    found = find_rate(None, OPTIONS, measure)
    assert found.rate_hz == taken
    assert found.is_enough == (busy[-1] < 2 / 3)
    assert len(found.tried) == len(asked) == n_tried
    assert asked == [("ofdm", rate_hz) for rate_hz in (5e6, 2e6, 1e6, 5e5)[:n_tried]]


@pytest.mark.long
def test_what_is_measured_is_a_daemon_with_this_traffic():
    source = open_source(None, None, [], 15.0, 1)
    found = tried_out(source, Options(link="ofdm", rate_hz=2e6))
    assert found.rate_hz == 2e6
    assert 0.1 < found.air < 1.1
    assert found.busy > 0.05


def test_of_a_process_the_busiest_thread_counts():
    code = "import sys, threading; print('.', flush=True)\nwhile True: pass"
    command = [sys.executable, "-c", code]
    with Process(command) as busy, Process(command) as still:
        for each in (busy, still):
            each.line()
        still.send_signal(signal.SIGSTOP)
        wait_for(lambda: " T " in Path(f"/proc/{still.pid}/stat").read_text())
        loads = [LoadOf(each.pid) for each in (busy, still)]
        wait_for(lambda: loads[0].read().busy > 0.9)
        assert loads[1].read().busy < 0.1
        load = loads[0].read()
        assert 0 <= load.waited <= load.busy <= 1
        # A stopped process cannot receive a request to end.
        still.kill()
