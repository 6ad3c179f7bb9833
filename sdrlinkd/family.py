"""A process and all processes below it: a daemon, its modem, its driver."""

import contextlib
import os
from pathlib import Path

TICKS_HZ = os.sysconf("SC_CLK_TCK")


def family(pid: int) -> list[int]:
    """The process and every running process that it has started, directly or not."""
    parents = {}
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):
            parents[int(folder.name)] = int(process_fields(int(folder.name))[1])
    found = [pid]
    for each in found:
        found += [child for child, parent in parents.items() if parent == each]
    return found


def family_cpu_s(pid: int) -> float:
    """CPU time in s that a process and all processes below it have used so far.

    A process that has ended counts once its parent has waited for it.
    """
    ticks = 0
    for each in family(pid):
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):
            # utime, stime, cutime and cstime are fields 14 to 17.
            ticks += sum(map(int, process_fields(each)[11:15]))
    return ticks / TICKS_HZ


def family_threads(pid: int) -> list[Path]:
    """Folders in /proc of the threads of a process and of all processes below it."""
    found: list[Path] = []
    for each in family(pid):
        with contextlib.suppress(OSError):
            found += Path(f"/proc/{each}/task").iterdir()
    return found


def process_fields(pid: int) -> list[str]:
    """Fields of proc(5), from the third on, which is the state."""
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
