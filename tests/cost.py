"""What tests cost: the processor time of this process and of all that descend from it."""

import contextlib
import os
import resource
import time
from collections.abc import Iterator
from pathlib import Path

TICK_S = 1 / os.sysconf("SC_CLK_TCK")
LOOPS = 200_000
USUAL_S = 0.012
"""What these loops take a core of 3 GHz that does nothing else."""
LOOKS = 10
"""How often, a tick apart, the variables of a process are looked at that shows none yet."""
FIRST = 11
"""Where the four times begin in /proc/PID/stat, behind the name."""


def spent_s() -> float:
    """Processor time in s of this process and its descendants, dead or alive.

    What leaves the family (a daemon that forks twice) is lost.
    """
    usages = map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    own = sum(usage.ru_utime + usage.ru_stime for usage in usages)
    return own + sum(map(_living_s, descendants(os.getpid())))


def descendants(pid: int) -> Iterator[int]:
    """The living children of process `pid`, their children, and so on."""
    # Processes and threads end while this looks at them.
    with contextlib.suppress(OSError):
        for thread in Path(f"/proc/{pid}/task").iterdir():
            with contextlib.suppress(OSError):
                for word in (thread / "children").read_text().split():
                    yield int(word)
                    yield from descendants(int(word))


def started_by(mark: str) -> Iterator[tuple[int, str, str]]:
    """Each living process with `mark` in its environment: id, test that began it, command."""
    own = set(descendants(os.getpid()))
    for process in Path("/proc").glob("[0-9]*"):
        try:
            if (process / "stat").read_text().rpartition(")")[2].split()[0] == "Z":
                continue
            words = _environment(process, is_own=int(process.name) in own)
        except OSError:
            continue
        if mark in words and int(process.name) != os.getpid():
            test = next((w for w in words if w.startswith("PYTEST_CURRENT_TEST=")), "=no test")
            command = (process / "cmdline").read_bytes().decode(errors="replace")
            yield (
                int(process.name),
                test.partition("=")[2].rpartition(" ")[0],
                command.replace("\0", " ").strip(),
            )


def _environment(process: Path, *, is_own: bool) -> list[str]:
    """The process's variables. One of our own that has begun this instant may show none yet."""
    for _ in range(LOOKS if is_own else 1):
        if found := (process / "environ").read_bytes():
            return found.decode(errors="replace").split("\0")
        time.sleep(TICK_S)
    return []


def _living_s(pid: int) -> float:
    """What the process and those children of it that it has waited for have used."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return TICK_S * sum(map(int, fields[FIRST : FIRST + 4]))


def slowness() -> float:
    """How many times as long as a usual core this one needs now, whoever else computes on it."""
    return max(1.0, min(_loop_s() for _ in range(3)) / USUAL_S)


def _loop_s() -> float:
    begin, total = time.process_time(), 0
    for i in range(LOOPS):
        total += i * i
    return time.process_time() - begin
