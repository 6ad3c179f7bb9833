"""What is asked of the kernel, and what becomes of it."""

import os
import platform
import resource
import subprocess
import sys
import time
from itertools import groupby

import pytest

from backends import Scheduling, take_short_slices
from backends.testing import REALTIME
from tests.docs.pages import ROOT

IN_A_PROCESS = """
import os, resource, sys, threading
from backends import Scheduling
{setup}
made = Scheduling(is_urgent={urgent})
found = []
thread = threading.Thread(target=lambda: found.append(os.sched_getscheduler(0)))
thread.start()
thread.join()
print(made.told, "|", made.advice[:9], "|", os.sched_getscheduler(0) == found[0], found[0])
"""


def run(setup="", urgent=True):
    """(what is told, whether there is advice, policy) of a process that does `setup` first."""
    code = IN_A_PROCESS.format(setup=setup, urgent=urgent)
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    told, advice, policy = done.stdout.strip().split(" | ")
    same, number = policy.split()
    assert same == "True", "threads inherit it"
    return told, advice.strip(), int(number)


def test_a_simulated_radio_asks_for_slices_only():
    told, advice, policy = run(urgent=False)
    assert told in ("short slices", "ordinary slices")
    assert (advice, policy) == ("", os.SCHED_OTHER)


def test_who_is_refused_goes_on_and_says_what_to_do():
    setup = (
        "os.geteuid = lambda: 1000\n"
        "resource.setrlimit(resource.RLIMIT_RTPRIO, (0, 0))\n"
        "resource.setrlimit(resource.RLIMIT_MEMLOCK, (0, 0))\n"
    )
    told, advice, policy = run(setup)
    assert told.endswith("no real-time priority, memory not locked")
    assert (advice, policy) == ("the modem", os.SCHED_OTHER)


@pytest.mark.skipif(
    os.geteuid() != 0 and resource.getrlimit(resource.RLIMIT_RTPRIO)[0] < REALTIME,
    reason="this user may not have real-time priority",
)
def test_a_device_gets_what_is_granted():
    told, advice, policy = run()
    assert "real-time priority" in told
    assert (advice, policy) == ("", os.SCHED_RR)


def test_a_machine_without_these_calls_goes_on(monkeypatch):
    monkeypatch.setattr(platform, "machine", lambda: "riscv64")
    assert not take_short_slices()


def test_a_whole_core_at_real_time_priority_is_given_up_for_a_second(monkeypatch):
    clock, cpu, policies = [100.0], [0.0], []
    granted = {resource.RLIMIT_RTPRIO: REALTIME, resource.RLIMIT_MEMLOCK: 0}
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    monkeypatch.setattr(resource, "getrlimit", lambda which: (granted[which], granted[which]))
    monkeypatch.setattr(os, "sched_setscheduler", lambda _, policy, __: policies.append(policy))
    monkeypatch.setattr(time, "monotonic", lambda: clock[0])
    monkeypatch.setattr(time, "process_time", lambda: cpu[0])
    made = Scheduling(is_urgent=True)
    for tenth in range(45):
        clock[0] += 0.1
        cpu[0] += 0.05 if tenth < 10 else 0.099
        made.look()
    # Once for each thread.
    taken = [policy for policy, _ in groupby(policies)]
    assert taken == [os.SCHED_RR, os.SCHED_OTHER, os.SCHED_RR, os.SCHED_OTHER]
    assert made.yields == 2
