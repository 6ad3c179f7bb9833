"""The sockets at which a process listens, and its children."""

import contextlib
from pathlib import Path

LISTENS = {"tcp": "0A", "tcp6": "0A", "udp": "07", "udp6": "07"}
PROC = Path("/proc")
UNIX_LISTENS = "00010000"


def family(pid):
    """A process and its children, and theirs."""
    found, more = [], [pid]
    while more:
        found += more
        more = [
            int(child)
            for each in more
            for task in _tasks(each)
            for child in (task / "children").read_text().split()
        ]
    return found


def ports(pid):
    """(protocol, address, port) at which a process listens, or which it has bound for UDP."""
    inodes, found = _inodes(pid), set()
    for table, state in LISTENS.items():
        for line in (PROC / str(pid) / "net" / table).read_text().splitlines()[1:]:
            columns = line.split()
            if columns[3] == state and columns[9] in inodes:
                address, _, port = columns[1].rpartition(":")
                found.add((table.removesuffix("6"), address, int(port, 16)))
    return found


def listening(pid):
    """Doors of a process and its children: "tcp", "udp", and "unix" with the name of the file.

    Of several at 127.0.0.1, one is told as "tcp", the others as "tcp local".
    """
    found = set()
    for each in family(pid):
        there = sorted(ports(each))
        found |= {protocol for protocol, _, _ in there}
        if sum(protocol == "tcp" for protocol, _, _ in there) > 1:
            found.add("tcp local")
        inodes = _inodes(each)
        for line in (PROC / str(each) / "net" / "unix").read_text().splitlines()[1:]:
            columns = line.split()
            if columns[3] == UNIX_LISTENS and columns[6] in inodes and len(columns) > 7:
                found.add(f"unix {Path(columns[7]).stem}")
    return found


def _tasks(pid):
    with contextlib.suppress(OSError):
        return list((PROC / str(pid) / "task").iterdir())
    return []


def _inodes(pid):
    """The inodes of the sockets that a process has open."""
    inodes = set()
    with contextlib.suppress(OSError):
        for each in (PROC / str(pid) / "fd").iterdir():
            with contextlib.suppress(OSError):
                inodes.add(str(each.readlink()).removeprefix("socket:[").removesuffix("]"))
    return inodes
