"""Checks this host's clock: whether it is synchronized, and whether it was stepped meanwhile."""

import os
from pathlib import Path

from sdrlinkd.doctor.finding import Finding, good, good_if, none
from sdrlinkd.kernelclock import KernelClock

STEP_S = 0.05


def check_clock(kernel: KernelClock | None, step_s: float, chrony: str) -> list[Finding]:
    """Findings on whether this host's clock is synchronized, and whether it was stepped meanwhile.

    `step_s` is the change of the wall clock relative to the monotonic clock, in s. `chrony` is the
    socket in the configuration, "" for none.
    """
    found = [
        _synchronized(kernel),
        good_if(
            abs(step_s) < STEP_S, "clock's steps",
            "none during this check" if abs(step_s) < STEP_S else f"it jumped by {step_s:+.3f} s",
            "let one program slew it: chrony, with makestep only at its start",
        ),
    ]  # fmt: skip
    if chrony:
        found.append(
            good_if(
                Path(chrony).exists() and os.access(chrony, os.W_OK), "chrony.socket", chrony,
                f"chronyd does not listen there: put `refclock SOCK {chrony}` in chrony.conf, and "
                "start chronyd before the daemon",
            )
        )  # fmt: skip
    return found


def _synchronized(kernel: KernelClock | None) -> Finding:
    what = "clock"
    if kernel is None:
        return none(what, "the kernel does not report it")
    if kernel.is_synchronized:
        return good(what, f"synchronized by NTP or similar, within {1e3 * kernel.error_s:.0f} ms")
    return none(
        what,
        "not synchronized: message ages do not need it; stamps in ROS messages do (chrony, or "
        "[chrony] from another robot)",
    )
