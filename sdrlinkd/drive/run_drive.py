"""The drive of a run of `lab` or `demo`, as `sdrlinkctl log` would have kept it."""

from collections.abc import Iterable
from pathlib import Path

from sdrlinkd.adapters import PLACES
from sdrlinkd.demo import Sample, Trace
from sdrlinkd.drive.keeping import Chronicle
from sdrlinkd.drive.names import DRIVE, received, sent
from sdrlinkd.drive.writer import DriveWriter
from sdrlinkd.reports import Snapshot

SECOND_NS = 1_000_000_000


class RunDrive:
    """Keeps a run in `folder`, in place of the drive of an earlier run; times in s of the run.

    `began_ns` is when the run began, in ns since 1970.
    """

    def __init__(self, folder: Path, began_ns: int) -> None:
        self._began_ns = began_ns
        (folder / DRIVE).unlink(missing_ok=True)
        self._writer = DriveWriter(folder)
        self._chronicles: dict[int, Chronicle] = {}
        self._senders: set[int] = set()

    def see(self, snapshots: Iterable[Snapshot], at_s: float) -> None:
        """Take the reports of all daemons."""
        for each in snapshots:
            chronicle = self._chronicles.setdefault(each.node, Chronicle(self._writer))
            chronicle.see(each, self._ns(at_s))

    def passed(self, sender: int, receiver: int, trace: Trace, begin_s: float) -> None:
        """Keep the messages of one robot to another one that say where it is.

        The trace's clock showed `begin_s` when the run began.
        """
        if sender not in self._senders:
            self._senders.add(sender)
            for name, samples in trace.sent.items():
                self._keep(sent(sender, f"/{name}"), trace.types.get(name, ""), samples, begin_s)
        for name, pairs in trace.matches()[0].items():
            topic, got = received(receiver, sender, f"/{name}"), [late for _, late in pairs]
            self._keep(topic, trace.types.get(name, ""), got, begin_s)

    def _keep(self, topic: str, kind: str, samples: Iterable[Sample], begin_s: float) -> None:
        if kind in PLACES:
            for each in samples:
                self._writer.message(topic, kind, each.payload, self._ns(each.at - begin_s))

    def close(self) -> None:
        """Close the file."""
        for each in self._chronicles.values():
            each.end()
        self._writer.close()

    def _ns(self, at_s: float) -> int:
        return self._began_ns + round(SECOND_NS * max(0.0, at_s))
