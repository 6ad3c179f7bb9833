"""Nine changes that no test noticed once; each is tried in every run."""

from typing import NamedTuple


class Planted(NamedTuple):
    """A change of a file: `old`, which is there once, becomes `new`."""

    name: str
    law: str
    """What no longer holds."""
    file: str
    old: str
    new: str
    reason: str = ""
    """Why it survives, if it may."""

    def changed(self, source: str) -> str:
        """The text of the file with the change."""
        assert source.count(self.old) == 1, f"{self.file} has not one {self.old!r}"
        return source.replace(self.old, self.new)


PLANTED = (
    Planted(
        "L2",
        "the robot for which least was repeated comes first",
        "sdrlinkd/link/repeat/answers.py",
        "self._served_s[asker] += each_s / len(wanted.askers)",
        "self._served_s[asker] += 0",
    ),
    Planted(
        "W1",
        "parity of another shape is not kept with a message",
        "sdrlinkd/wire/reassembly.py",
        "or partial.shape not in (None, shape)",
        "or False",
    ),
    Planted(
        "W2",
        "a CLOCK fits the start of one burst alone",
        "sdrlinkd/wire/later.py",
        "_STARTS = {int(RecordType.FRAME), int(RecordType.CLOCK)}",
        "_STARTS = {int(RecordType.FRAME)}",
    ),
    Planted(
        "B1",
        "what is forgotten takes no room among the retained messages",
        "sdrlinkd/bus/retained.py",
        "self._n_bytes -= series.n_bytes",
        "pass",
    ),
    Planted(
        "B2",
        "a subscriber that reads slowly is not stuck",
        "sdrlinkd/bus/undropped.py",
        "            lane.moved_at = now\n",
        "            pass\n",
    ),
    Planted(
        "B3",
        "a message of an encapsulation header alone is accepted",
        "sdrlinkd/bus/intake.py",
        "if size < CDR_HEADER_SIZE:",
        "if size <= CDR_HEADER_SIZE:",
    ),
    Planted(
        "F1",
        "a leader that hears less than before and says so goes on leading",
        "sdrlinkd/fleet/election.py",
        "if leader is not None and leader.beats(claim) and claim.gw != leader.gw:",
        "if leader is not None and leader.beats(claim):",
    ),
    Planted(
        "F2",
        "after a message was put twice, copies are held for twice as long",
        "sdrlinkd/fleet/forwarding.py",
        "self.hold_s = min(MOST_HOLD_S, 2 * self.hold_s)",
        "self.hold_s = min(MOST_HOLD_S, self.hold_s)",
    ),
    Planted(
        "F3",
        "a command with the same number again is refused, however late",
        "sdrlinkd/fleet/commands.py",
        "if number <= newest:",
        "if number < newest:",
    ),
)
