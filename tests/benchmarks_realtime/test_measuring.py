"""What a run is made of: latencies and ages of messages, and what a daemon's processes use."""

import os
import subprocess
import sys
import threading
from argparse import ArgumentTypeError

import numpy as np
import pytest

from benchmarks.environments import ROOT
from benchmarks.processes import family_memory_mb
from benchmarks.realtime.alone import LASER, airtime_ms
from benchmarks.realtime.slice import take_short_slice
from benchmarks.realtime.traffic import AT, CDR, WARM_UP_S, Record, flow, stamp
from benchmarks.realtime.trees import checkout
from sdrlinkd.config import ModemParams
from sdrlinkd.family import family, family_cpu_s
from sdrlinkd.localtime import header_stamp_ns
from sdrlinkd.modem import Airtimes

BUSY = """
import subprocess, sys, time
depth = int(sys.argv[2])
below = depth and subprocess.Popen([sys.executable, "-c", sys.argv[1], sys.argv[1], str(depth - 1)],
                                   stdin=sys.stdin, stdout=sys.stdout)
while time.process_time() < 0.15:
    pass
print(depth, flush=True)
sys.stdin.read()
"""
"""Uses 0.15 s of CPU time, as do a child and a grandchild; ends with its input."""


def test_a_lost_message_is_infinitely_late():
    ms = 10**6
    record = Record({b"a": 0, b"b": 5 * ms, b"c": 9 * ms}, {b"a": 4 * ms, b"c": 12 * ms, b"x": 1})
    assert (record.lost, record.is_complete) == (1, False)
    assert record.late_ms().tolist() == [4.0, np.inf, 3.0]
    record.heard[b"b"] = 6 * ms
    assert (record.lost, record.is_complete) == (0, True)


def test_an_age_that_is_told_too_small_has_a_positive_error():
    # Sent at 1 ms; handed over at 8 ms with an age of 6.5 ms: published at 1.5 ms by that account.
    record = Record({b"a": 10**6, b"b": 0}, {}, {b"a": 1_500_000, b"not counted": 0})
    assert record.age_errors_us().tolist() == [500.0]


def test_the_stamp_is_that_of_a_header():
    now_ns = 1_700_000_000_123_456_789
    message = CDR + stamp(now_ns) + bytes(8)
    assert (header_stamp_ns(message), message[AT]) == (now_ns, stamp(now_ns))


def test_a_flow_counts_after_its_warm_up():
    laser = flow("laser", 1032, 0.02, 3.0)
    times = laser.times(np.random.default_rng(1))
    assert np.count_nonzero(times >= WARM_UP_S) == 150


def test_the_airtimes_are_those_of_the_rows():
    assert airtime_ms() == pytest.approx(2.85, abs=0.02)
    assert "pdu_size = 1058" in LASER
    modem = ModemParams(rate_hz=5e6, mcs=3)
    assert 1e3 * Airtimes(modem, 1058).airtime_s(3, 1) == pytest.approx(1.53, abs=0.02)


def test_children_and_grandchildren_count():
    process = subprocess.Popen(
        [sys.executable, "-c", BUSY, BUSY, "2"], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    try:
        assert {process.stdout.readline() for _ in range(3)} == {b"0\n", b"1\n", b"2\n"}
        members = family(process.pid)
        assert (members[0], len(members), os.getpid() in members) == (process.pid, 3, False)
        assert members[0] in family(os.getpid())
        # The kernel counts in ticks of 10 ms.
        assert 0.4 < family_cpu_s(process.pid) < 3
        memory = family_memory_mb(process.pid)
        assert 3 < memory["Pss"] < memory["Rss"]
    finally:
        process.communicate()


def test_a_child_that_has_ended_still_counts():
    before_s = family_cpu_s(os.getpid())
    busy = "import time\nwhile time.process_time() < 0.2: pass"
    subprocess.run([sys.executable, "-c", busy], check=True)
    assert family_cpu_s(os.getpid()) - before_s > 0.15


def test_a_thread_may_ask_for_a_short_slice():
    """Whether or not the kernel grants it, the thread stays an ordinary one."""
    found = []

    def ask():
        found.append(take_short_slice())
        found.append((os.sched_getscheduler(0), os.getpriority(os.PRIO_PROCESS, 0)))

    thread = threading.Thread(target=ask)
    thread.start()
    thread.join()
    assert isinstance(found[0], bool)
    assert found[1] == (os.SCHED_OTHER, os.getpriority(os.PRIO_PROCESS, 0))


def test_another_checkout_must_be_one(tmp_path):
    assert checkout(str(ROOT)) == ROOT
    with pytest.raises(ArgumentTypeError, match=r"which has no sdrlinkd; allowed: a checkout"):
        checkout(str(tmp_path))
