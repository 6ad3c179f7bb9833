"""Checks the computer: its cores, their load, and whether they are slowed down."""

from pathlib import Path

from sdrlinkd.doctor.finding import Finding, bad, good, good_if, none

BUSY = 1.0
"""Load average per core above which programs wait for each other."""
STOLEN = 0.05
"""Share of stolen CPU time above which a virtual machine loses samples."""
SLOW_GOVERNORS = ("powersave", "conservative")


def check_machine(
    cores: int, load: float, stat: tuple[str, str], cpus: Path, *, is_timed: bool
) -> list[Finding]:
    """Findings on whether the computer has the cores and the CPU time that a node needs.

    `load` is the load average of the last minute. `stat` holds /proc/stat, read twice some time
    apart. `cpus` is /sys/devices/system/cpu. `is_timed`: a real or simulated radio needs its
    samples in time.
    """
    return [
        good_if(
            cores > 1 or not is_timed, "cores", f"{cores}",
            "use at least two cores: one for the modem, one for everything else",
        ),
        good_if(
            load <= BUSY * cores, "load", f"{load:.2f} on {cores} cores in the last minute",
            "end other programs, or give the daemon its own cores (systemd: AllowedCPUs=)",
        ),
        _stolen(*stat),
        _governor(cpus, is_timed=is_timed),
    ]  # fmt: skip


def check_machine_id(machine_id: str, copies: list[int] | None) -> Finding:
    """A finding on whether this computer can be told from others, as sealing needs.

    `copies` are robots on other computers with the same id, as a running daemon has heard them;
    None: no daemon runs.
    """
    what = "machine id"
    renewed = "sudo rm /etc/machine-id && sudo systemd-machine-id-setup, then restart the computer"
    if copies:
        robots = " and ".join(f"robot {src}" for src in copies)
        return bad(what, f"that of {robots}, too: one disk is a copy of the other", renewed)
    if not machine_id or machine_id == "uninitialized":
        return none(what, "none: nobody can tell a copy of this disk from this computer")
    heard = "" if copies is None else ", not heard of any other robot"
    return good(what, f"{machine_id[:8]}…{heard}")


def _stolen(before: str, after: str) -> Finding:
    first, last = _times(before), _times(after)
    spent = [late - early for early, late in zip(first, last, strict=False)]
    if len(spent) < 8 or sum(spent) <= 0:
        return none("stolen time", "/proc/stat does not report it")
    share = spent[7] / sum(spent)
    return good_if(
        share <= STOLEN, "stolen time", f"{100 * share:.0f} % of the CPU time was stolen",
        "a virtual machine with shared cores drops samples: use a dedicated host or pinned cores",
    )  # fmt: skip


def _times(stat: str) -> list[int]:
    """The CPU times of all cores together, in ticks: user, nice, system, idle, …, stolen."""
    line = next((line for line in stat.splitlines() if line.startswith("cpu ")), "")
    return [int(each) for each in line.split()[1:9] if each.isdigit()]


def _governor(cpus: Path, *, is_timed: bool) -> Finding:
    found = set()
    for path in cpus.glob("cpu[0-9]*/cpufreq/scaling_governor"):
        try:
            found.add(path.read_text().strip())
        except OSError:
            continue
    if not found:
        return none("frequency governor", "this machine has none")
    told = ", ".join(sorted(found))
    if is_timed and found & set(SLOW_GOVERNORS):
        return bad(
            "frequency governor", told,
            "a throttled core is late: sudo cpupower frequency-set -g performance",
        )  # fmt: skip
    return good("frequency governor", told)
