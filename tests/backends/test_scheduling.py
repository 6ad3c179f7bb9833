"""What is asked of the kernel, and what becomes of it."""

import itertools
import os
import resource
import subprocess
import sys

import pytest

from backends import scheduling
from backends.scheduling import REALTIME, Scheduling
from tests.docs.pages import ROOT

IN_A_PROCESS = """
import os, resource, sys, threading
from backends import scheduling
{setup}
made = scheduling.Scheduling(is_urgent={urgent})
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
    monkeypatch.setattr(scheduling.platform, "machine", lambda: "riscv64")
    assert not scheduling.take_short_slices()


def test_a_whole_core_at_real_time_priority_is_given_up_for_a_second(monkeypatch):
    clock, cpu, policies = [100.0], [0.0], []
    monkeypatch.setattr(scheduling, "hurry", lambda: True)
    monkeypatch.setattr(scheduling, "lock_memory", lambda: True)
    monkeypatch.setattr(scheduling, "take_short_slices", lambda: True)
    monkeypatch.setattr(scheduling.time, "monotonic", lambda: clock[0])
    monkeypatch.setattr(scheduling.time, "process_time", lambda: cpu[0])
    monkeypatch.setattr(
        scheduling.os, "sched_setscheduler", lambda _, policy, __: policies.append(policy)
    )
    made = Scheduling(is_urgent=True)
    for tenth in range(45):
        clock[0] += 0.1
        cpu[0] += 0.05 if tenth < 10 else 0.099
        made.look()
    # Each time, every thread of this process gets the policy.
    changes = [policy for policy, _ in itertools.groupby(policies)]
    assert changes == [os.SCHED_OTHER, os.SCHED_RR, os.SCHED_OTHER]
    assert made.yields == 2
