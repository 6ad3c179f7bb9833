"""The drive of a run, as `sdrlinkctl log` would have kept it."""

from collections.abc import Iterable, Mapping
from pathlib import Path

from sdrlinkd.adapters import PLACES
from sdrlinkd.demo import Sample
from sdrlinkd.drive import DRIVE, Chronicle, DriveWriter, received, sent
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

    def see(self, snapshots: Iterable[Snapshot], at_s: float) -> None:
        """Take the reports of all daemons."""
        for each in snapshots:
            chronicle = self._chronicles.setdefault(each.node, Chronicle(self._writer))
            chronicle.see(each, self._ns(at_s))

    def places(
        self, robot: int, at: int | None, types: Mapping[str, str],
        samples: Mapping[str, Iterable[Sample]], begin_s: float,
    ) -> None:  # fmt: skip
        """Take the messages of a robot that say where it is, as `at` received them."""
        for name, each in samples.items():
            if types.get(name) not in PLACES:
                continue
            topic = f"/{name}"
            named = sent(robot, topic) if at is None else received(at, robot, topic)
            for sample in each:
                at_ns = self._ns(sample.at - begin_s)
                self._writer.message(named, types[name], sample.payload, at_ns)

    def close(self) -> None:
        """Close the file."""
        for each in self._chronicles.values():
            each.end()
        self._writer.close()

    def _ns(self, at_s: float) -> int:
        return self._began_ns + round(SECOND_NS * max(0.0, at_s))
